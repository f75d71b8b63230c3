#!/bin/bash
# The steps of README.md and docs/*.md, line by line, as somebody without packages would follow them (mosaics need libstb): in a copy of
# the sources, on pictures that our own programs draw. What a line says that it writes must be a picture afterwards.
# usage: tests/check_doors.sh PAGE, a stem: README, photo, mosaic, engine
lib=$1
. "$(dirname "$0")/check.sh"
page=docs/$lib.md; [ -f "$page" ] || page=$lib.md
dir=build/check/doors/$lib; rm -rf "$dir"; mkdir -p "$dir/home/Pictures"
cp -R ./*.h Makefile examples tests docs README.md "$dir" || exit 1
steps=$(awk '$0 == "<!-- steps -->" { on = 1; next } on == 1 && /^```sh/ { on = 2; next } on == 2 && /^```/ { on = 0; next } on == 2' "$page")
[ -n "$steps" ] || fail "$page has no steps"
cd "$dir" || exit 1
export HOME=$PWD/home NO_DEPS=1
[ "$lib" = mosaic ] || export NO_PACKAGES=1 # photographs are read by libstb
[ "$lib" != README ] || export ARGS='--size 320x180'

picture() { [ -s "$1" ] && case $1 in *.png) [ "$(head -c 4 "$1" | tail -c 3)" = PNG ] ;; esac; }
case $lib in
    photo) # a photograph of somebody's
        make -s build/tonemap >/dev/null && build/tonemap --size 320x180 --operator linear -o picture.hdr >/dev/null || fail "no picture to start from" ;;
    mosaic) # a target, and a folder of pictures
        make -s build/tonemap >/dev/null && build/tonemap --size 400x225 -o target.png >/dev/null || fail "no target to start from"
        make -s build/photomosaic >/dev/null && build/photomosaic target.png --grid 2x2 --out trial.png 2>&1 | grep -q libstb && { skip "libstb is not here"; finish; }
        for i in $(seq 100); do
            build/tonemap --size 16x16 --threads 1 --red 1.$((i % 7)) --blue 1.$((i % 11)) --exposure 0.0$((i % 97)) -o "home/Pictures/$i.png" >/dev/null
            for j in $(seq 20); do ln "home/Pictures/$i.png" "home/Pictures/$i.$j.png"; done
        done ;;
esac
while IFS= read -r line; do
    what=${line%%#*}
    case $what in make\ deps*) continue ;; esac
    if text=$(sh -ec "$line" 2>&1); then pass; else fail "$page: $what" "$text"; continue; fi
    for word in $(grep -oE '(-o|--out) [^ ]+\.(png|hdr)' <<<"$what" | awk '{ print $2 }'); do
        if picture "$word"; then pass; else fail "$page: $what: $word is no picture"; fi
    done
done <<<"$steps"
[ "$lib" != engine ] || { if picture game/first_ssao_sat.png; then pass; else fail "$page: the first program drew nothing"; fi; }
[ "$lib" != README ] || { if picture out/demo.png; then pass; else fail "$page: make demo drew nothing"; fi; }
finish
