#!/bin/bash
# The window and the page show what the demo writes. usage: tests/check_view.sh view|web
lib=$1
. "$(dirname "$0")/check.sh"
dir=build/check/view
mkdir -p "$dir"

# same SHOT TOP [OPTION...]: below row TOP the picture is the demo's with these options, but for one step of rounding
same() {
    local shot=$1 crop="640x$((360 - $2))+0+$2" text
    shift 2
    ok "the demo runs" build/demo --size 640x360 --samples 1 "$@" --out "$dir/demo.png"
    convert "$shot" -crop "$crop" +repage "$shot.a.png" && convert "$dir/demo.png" -crop "$crop" +repage "$shot.b.png"
    text=$(compare -metric PAE "$shot.a.png" "$shot.b.png" null: 2>&1) # "257 (0.00392157)": one code of 255
    if awk -v d="${text%% *}" 'BEGIN { exit !(d ~ /^[0-9.]+$/ && d + 0 <= 257) }'; then pass
    else fail "$shot differs from the demo's picture $*" "largest difference $text"; fi
}

# alike SHOT OPTION...: the picture is the demo's but for half a code of 255, root mean square
alike() {
    local shot=$1 text
    shift
    ok "the demo runs" build/demo --size 640x360 --samples 1 "$@" --out "$dir/demo.png"
    text=$(compare -metric RMSE "$shot" "$dir/demo.png" null: 2>&1) # "11.9 (0.00018)"
    if awk -v d="${text%% *}" 'BEGIN { exit !(d ~ /^[0-9.]+$/ && d + 0 <= 128) }'; then pass
    else fail "$shot differs from the demo's picture $*" "root mean square difference $text"; fi
}

# refused FILE: the page says in red why it cannot read this, and shows what it showed
refused() {
    local name=${1##*/} shot="$dir/web_refused.png" text
    rm -f "$shot"
    text=$(timeout 150 node tests/drop.js out/web/index.html "$shot" "$1" 2>&1)
    if grep -q "^error $name: ." <<<"$text" && grep -q "seen in rgb(255, 136, 136)" <<<"$text"; then pass
    else fail "a refused $name is not named, or not in sight" "$text"; fi
    if [ -f "$shot" ]; then same "$shot" 0; else fail "there is no screenshot after $name"; fi
}

# dropped FILE: a broken file and then this one are dropped; the page names what is wrong, goes on and shows the light of the other
dropped() {
    local name=${1##*/} shot="$dir/web_${1##*.}.png" text
    head -c 60 "$1" >"$dir/broken_$name"
    rm -f "$shot"
    text=$(timeout 150 node tests/drop.js out/web/index.html "$shot" "$dir/broken_$name" "$1" 2>&1)
    if grep -q "^error broken_$name: ." <<<"$text"; then pass; else fail "a broken $name is not named" "$text"; fi
    if grep -q "^ light: $name, " <<<"$text"; then pass; else fail "a dropped $name is not read" "$text"; fi
    if [ -f "$shot" ]; then same "$shot" 0 --env "$1"; else fail "there is no screenshot of $name"; fi
}

have convert && have compare || { skip "no ImageMagick (imagemagick) to compare pictures"; finish; }
rm -f "$dir/$lib.png"
case $lib in
    view)
        [ -x build/demo_view ] || { skip "no GLFW (libglfw3-dev)"; finish; }
        have xvfb-run || { skip "no Xvfb (xvfb, xauth)"; finish; }
        export LIBGL_ALWAYS_SOFTWARE=1
        for gl in '' --gl; do
            rm -f "$dir/view$gl.png"
            ok "demo_view $gl under Xvfb" timeout 120 xvfb-run -a -s "-screen 0 800x600x24" \
                build/demo_view $gl --frames 1 --out "$dir/view$gl.png"
            [ ! -f "$dir/view$gl.png" ] || same "$dir/view$gl.png" 28 $gl
        done
        have xdotool || { skip "no xdotool to press keys"; finish; }
        rm -f "$dir/view_keys.png"
        ok "demo_view with key G under Xvfb" timeout 120 xvfb-run -a -s "-screen 0 800x600x24" bash -c 'build/demo_view --gl --frames 15 --out "$0" &
            xdotool search --sync --name "^lightscan$" && sleep 1 && xdotool key g; wait $!' "$dir/view_keys.png"
        # the overlay begins with the word CPU instead of OpenGL
        for shot in view--gl view_keys view; do
            convert "$dir/$shot.png" -crop 18x8+6+6 +repage -colorspace gray -threshold 85% "$dir/$shot.word.png"
        done
        if [ "$(compare -metric AE "$dir/view.word.png" "$dir/view_keys.word.png" null: 2>&1)" = 0 ] &&
            [ "$(compare -metric AE "$dir/view--gl.word.png" "$dir/view_keys.word.png" null: 2>&1)" != 0 ]; then pass
        else fail "key G does not switch OpenGL off: $dir/view_keys.png"; fi
        ;;
    web)
        [ -f out/web/demo_web.js ] || { skip "no emscripten (emscripten): make web"; finish; }
        have chromium || { skip "no chromium"; finish; }
        have node || { skip "no node (nodejs) to drive chromium"; finish; }
        ok "the page in headless Chromium" timeout 150 node tests/drop.js out/web/index.html "$dir/web.png"
        if [ -f "$dir/web.png" ]; then same "$dir/web.png" 0; else fail "there is no screenshot"; fi
        rm -f "$dir/web_gl.png"
        ok "the page by WebGL" timeout 150 node tests/drop.js out/web/index.html#test-gl "$dir/web_gl.png"
        if [ -f "$dir/web_gl.png" ]; then alike "$dir/web_gl.png" --gl; else fail "there is no screenshot by WebGL"; fi
        head -c 100 build/demo >"$dir/nothing.pfm" && refused "$dir/nothing.pfm"
        kind=hdr; [ -f build/web/stb.o ] || kind=pfm
        convert -size 96x48 'gradient:#9bf-#321' "$dir/light.$kind" && dropped "$dir/light.$kind"
        if [ -f build/web/libexr.a ]; then
            rm -f "$dir/light.exr"
            ok "the demo makes a light" build/demo --size 128x64 --samples 1 --out "$dir/light.exr"
            if [ -f "$dir/light.exr" ]; then dropped "$dir/light.exr"; else skip "no OpenEXR (libopenexr-dev) to write a light"; fi
        else skip "the page is without OpenEXR: the sources were not fetched"; fi
        ;;
esac
finish
