#!/bin/bash
# The window and the page show what the demo writes. usage: tests/check_view.sh view|web
lib=$1
. "$(dirname "$0")/check.sh"
dir=build/check/view
mkdir -p "$dir"

# same SHOT TOP: below row TOP the picture is the demo's, but for one step of rounding
same() {
    local text
    ok "the demo runs" build/demo --size 640x360 --samples 1 --out "$dir/demo.png"
    convert "$1" -crop "640x$((360 - $2))+0+$2" +repage "$1.a.png" && convert "$dir/demo.png" -crop "640x$((360 - $2))+0+$2" +repage "$1.b.png"
    text=$(compare -metric PAE "$1.a.png" "$1.b.png" null: 2>&1) # "257 (0.00392157)": one code of 255
    if awk -v d="${text%% *}" 'BEGIN { exit !(d ~ /^[0-9.]+$/ && d + 0 <= 257) }'; then pass
    else fail "$1 differs from $dir/demo.png" "largest difference $text"; fi
}

have convert && have compare || { skip "no ImageMagick (imagemagick) to compare pictures"; finish; }
rm -f "$dir/$lib.png"
case $lib in
    view)
        [ -x build/demo_view ] || { skip "no GLFW (libglfw3-dev)"; finish; }
        have xvfb-run || { skip "no Xvfb (xvfb, xauth)"; finish; }
        LIBGL_ALWAYS_SOFTWARE=1 ok "demo_view under Xvfb" timeout 120 xvfb-run -a -s "-screen 0 800x600x24" \
            build/demo_view --frames 1 --out "$dir/view.png"
        [ ! -f "$dir/view.png" ] || same "$dir/view.png" 28
        ;;
    web)
        [ -f out/web/demo_web.js ] || { skip "no emscripten (emscripten): make web"; finish; }
        have chromium || { skip "no chromium"; finish; }
        ok "the page in headless Chromium" timeout 240 chromium --headless --no-sandbox --use-angle=swiftshader \
            --enable-unsafe-swiftshader --hide-scrollbars --window-size=640,360 --virtual-time-budget=20000 --timeout=120000 \
            --user-data-dir="$(mktemp -d)" --screenshot="$dir/web.png" "file://$PWD/out/web/index.html#test"
        if [ -f "$dir/web.png" ]; then same "$dir/web.png" 0; else fail "there is no screenshot"; fi
        ;;
esac
finish
