#!/bin/bash
# The programs of examples/: what they take, what they refuse and with which words, and that they never write over what they
# read. usage: tests/check_strict.sh examples (which includes this file)

# Small work for each program; all of them are compiled without any package, so that inputs are .pfm, .hdr and .obj.
declare -A quick=(
    [tonemap]="--size 40x30" [guided]="--size 40x30" [ssao]="--size 32" [fiv_shadows]="--size 24x18 --theta 8" [raindrops]="--size 40x30 --count 100"
    [photomosaic]="--grid 4x4 --tile 8" [demo]="--size 32x32 --samples 1 --no-shadows --no-occlusion")

# run STATUS SENTENCE PROGRAM ARGUMENT...: ends so, with one line on stderr that holds the words ('' : nothing on stderr)
run() {
    local status=$1 words=$2 text rc
    shift 2
    text=$(cd "$ground" && timeout 60 "../$1" "${@:2}" 2>&1 >stdout)
    rc=$?
    if [ $rc = "$status" ] && { [ -z "$words" ] && [ -z "$text" ] || { [ -n "$words" ] && [[ $text == *"$words"* ]] && [ "$(wc -l <<<"$text")" = 1 ]; }; }; then pass
    else fail "$*: wanted status $status and \"$words\"" "status $rc
$text"; fi
    [ ! -n "$(find "$ground" -name '.lightscan*')" ] || { fail "$*: leaves a part of a file"; find "$ground" -name '.lightscan*' -delete; }
}

# Every range that --help states: one step beyond each end, and words that are no number, are refused with that range.
check_ranges() {
    local program=$1 line name range low high value
    while IFS= read -r line; do
        name=$(sed -n 's/^  --\([a-z0-9-]*\) .*/\1/p' <<<"$line")
        if [[ $line =~ \(([^\(\)\;]*)\;\ ([^\(\)]*)\)$ && $line =~ --[a-z0-9-]*\ (N|WxH)\  ]]; then
            range=${line##*; } range=${range%)}
            if [[ $range == *x*\ to\ *x* ]]; then
                low=${range%%x*} high=${range##*x}
                for value in $((low - 1))x$low ${low}x$((high + 1)) 0x0 10 10x10x10 ''; do run 2 "--$name $value: must be $range" "$program" --"$name=$value"; done
                continue
            elif [[ $range == "a number of at least "* ]]; then low=${range##* } high=''
            else low=${range% to *} low=${low##* } high=${range##* }; fi
            value=$(awk -v v="$low" 'BEGIN { printf "%.10g", v - 1 }')
            run 2 "--$name $value: must be $range" "$program" --"$name=$value"
            [ -z "$high" ] || value=$(awk -v v="$high" 'BEGIN { printf "%.10g", v < 1e8 ? v + 1 : 2 * v }')
            [ -z "$high" ] || run 2 "--$name $value: must be $range" "$program" --"$name=$value"
            for value in nan many '' 1e400x 99999999999999999999999x; do run 2 "--$name $value: must be $range" "$program" --"$name=$value"; done
        elif [[ $line == *" WORD "* ]]; then
            run 2 "--$name none-of-them: must be " "$program" "--$name=none-of-them"
            run 2 "--$name : must be " "$program" "--$name="
        fi
    done < <("$dir/$program" --help | grep '^  --')
}

# The output: where it may not go. $2: an input of the program with an ending that the program could write, or a mesh
check_outputs() {
    local program=$1 input=$2 args=(${quick[$1]}) end=${2##*.}
    run 2 ".tga is not among the formats that can be written: .png" "$program" "$input" --out o.tga
    run 2 ".jpeg is not among the formats" "$program" "$input" -o o.JPEG.jpeg
    run 2 "has no ending" "$program" "$input" --out /dev/full
    run 2 "has no ending" "$program" --out=
    run 1 "there is no such folder" "$program" "$input" --out no/folder/o.png
    run 1 "folder.png: is a folder" "$program" "$input" --out folder.png
    run 1 "cannot be written" "$program" "$input" --out "$input/o.png"
    run 1 "cannot be written" "$program" "$input" --out /proc/o.png
    run 1 "cannot be written" "$program" "$input" --out loop.png
    ln -sf "$input" "$ground/soft.png"
    ln -f "$ground/$input" "$ground/hard.png"
    for link in soft.png hard.png ./soft.png folder.png/../hard.png; do
        run 2 "$link: is one of the files that are read" "$program" "$input" --out $link
    done
    rm -f "$ground/soft.png" "$ground/hard.png"
    run 2 "is one argument too many" "$program" "$input" "$input" "$input" "$input" --out o.png
    [ "$program" != demo_web ] || return
    run 1 "no/such.$end: " "$program" "no/such.$end" --out o.png
    # devices are written as they are: /dev/full has no room
    ln -sf /dev/full "$ground/full.png"
    run 1 "No space left" "$program" "${args[@]}" "$input" --out full.png
    # what is there stays when there is no room for more
    if [ -d "$ground/small/there" ]; then
        printf old >"$ground/small/o.png"
        head -c 70000 /dev/zero >"$ground/small/fill" 2>/dev/null
        run 1 "No space left" "$program" "${args[@]}" "$input" --out small/o.png
        if [ "$(cat "$ground/small/o.png")" = old ]; then pass; else fail "$program: the old file is gone from the full disk"; fi
        run 1 "Read-only" "$program" "${args[@]}" "$input" --out fixed/o.png
    fi
    # without --out, and over an old file through a link
    rm -rf "$ground/out"
    run 0 "" "$program" "${args[@]}" "$input"
    if [ -s "$ground/out/$program.png" ] && [ "$(cat "$ground/stdout" | tail -1)" = "out/$program.png" ]; then pass
    else fail "$program $input: out/$program.png is not there or not named" "$(cat "$ground/stdout")"; fi
    printf old >"$ground/target.png"
    chmod 600 "$ground/target.png"
    ln -sf target.png "$ground/to_target.png"
    run 0 "" "$program" "${args[@]}" "$input" --out to_target.png
    if [ -L "$ground/to_target.png" ] && cmp -s "$ground/target.png" "$ground/out/$program.png" && [ "$(stat -c %a "$ground/target.png")" = 600 ]; then pass
    else fail "$program: a link to the output is not followed, or its picture or mode is another"; fi
}

# What belongs to one program alone.
check_words() {
    run 2 "is no mesh (.ply .obj)" ssao o.png
    run 2 "is no picture (.exr .hdr .pfm .png .jpg)" tonemap in.tiff
    run 2 "is neither a picture" demo in.tiff
    run 2 "other.pfm: is there already" tonemap in.pfm other.pfm
    run 2 "in.pfm: is the input" tonemap in.pfm in.pfm
    run 0 "" tonemap in.pfm fresh.pfm
    run 0 "" tonemap in.pfm fresh.hdr
    run 0 "" ssao --size 32 --scene 1 --out scene.png
    run 0 "" ssao --size 32 mesh.obj --out mesh.png
    if cmp -s "$ground/scene.png" "$ground/mesh.png"; then fail "ssao draws a scene instead of the mesh"; else pass; fi
    run 0 "" ssao --size 32 --occlusion --out open.pfm
    run 2 ".pfm is not among the formats that can be written: .png" ssao --size 32 --compare --out o.pfm
    run 2 ".hdr is not among the formats" raindrops --sheet --out o.hdr
    run 1 "ends too early" tonemap half.hdr o.png
    run 1 "has no triangles" ssao empty.obj o.png
    run 1 "tiles/no.png: cannot be opened" photomosaic --grid 2x2 --tiles tiles/no.png
    run 2 "is one of the files that are read" photomosaic --grid 2x2 --tiles tiles --out tiles/a.png
    # tiles of a folder: what cannot be read is counted, an index gives the same mosaic without opening them, and is no other file
    mkdir -p "$ground/album/deep"
    (cd "$ground" && cp in.pfm album/a.pfm && cp in.hdr album/deep/b.hdr && ln -sfn ../album album/again)
    run 0 "" photomosaic --grid 1x2 --tile 8 --tiles album --index tiles.index --out first.png
    run 0 "" photomosaic --grid 1x2 --tile 8 --tiles album --index tiles.index --stats --out second.png
    if cmp -s "$ground/first.png" "$ground/second.png" && grep -q '^2 tiles, 2 of them from the index' "$ground/stdout"; then pass; else fail "an index changes the mosaic" "$(cat "$ground/stdout")"; fi
    truncate -s -100 "$ground/tiles.index"
    run 0 "" photomosaic --grid 1x2 --tile 8 --tiles album --index tiles.index --stats --out second.png
    if cmp -s "$ground/first.png" "$ground/second.png" && grep -q '^2 tiles, 1 of them from the index' "$ground/stdout"; then pass; else fail "a torn index" "$(cat "$ground/stdout")"; fi
    run 1 "is of tiles of another size" photomosaic --grid 1x2 --tile 9 --tiles album --index tiles.index
    run 1 "no index of tiles" photomosaic --grid 1x2 --tile 8 --tiles album --index in.hdr
    run 1 "3 cells need as many tiles, and there are 2; with --capacity 2" photomosaic --grid 1x3 --tile 8 --tiles album
    : >"$ground/album/c.png"
    if (cd "$ground" && ../photomosaic --grid 1x2 --tile 8 --tiles album --out third.png 2>&1 >stdout) | grep -q '1 of 3 files could not be read'; then pass; else fail "unreadable tiles are not counted"; fi
    cmp -s "$ground/first.png" "$ground/third.png" || fail "an unreadable tile changes the mosaic"
    run 0 "" demo ${quick[demo]} --frames 2 --out film.png
    if [ -s "$ground/film_0000.png" ] && [ -s "$ground/film_0001.png" ] && [ ! -e "$ground/film.png" ]; then pass; else fail "demo --frames 2"; fi
    # names that a program makes of the output's are looked at too
    cp "$ground/in.pfm" "$ground/film_0001.pfm"
    run 2 "must be even" fiv_shadows --theta 9
    run 1 "film_0001.pfm: is one of the files that are read" demo ${quick[demo]} film_0001.pfm --frames 2 --out film.pfm
    cmp -s "$ground/in.pfm" "$ground/film_0001.pfm" || fail "demo --frames writes over its input"
}

check_programs() {
    local program sums mounted=
    ground=$dir/ground
    mkdir -p "$ground/folder.png" "$ground/tiles" "$ground/small" "$ground/fixed"
    ln -sf loop.png "$ground/loop.png"
    (cd "$ground" && ../tonemap --size 40x30 --out in.pfm && ../tonemap --size 40x30 --out in.hdr && ../tonemap --size 64x32 --out tiles/a.png && cp in.pfm other.pfm &&
        head -c 2000 in.hdr >half.hdr && : >empty.obj && cp in.hdr in.tiff && printf 'v %s\n' '0 0 0' '1 0 0' '0 1 0' '0 0 1' >mesh.obj &&
        printf 'f %s\n' '1 3 2' '1 2 4' '1 4 3' '2 3 4' >>mesh.obj) >/dev/null || fail "the inputs cannot be made"
    if mount -t tmpfs -o size=64k none "$ground/small" 2>/dev/null; then
        mounted=$ground/small
        mkdir "$ground/small/there"
        mount -t tmpfs -o ro none "$ground/fixed" 2>/dev/null && mounted="$mounted $ground/fixed"
    else skip "no full disk and no read-only one: mounting is for root"; fi
    sums=$(cd "$ground" && cksum in.pfm in.hdr mesh.obj other.pfm half.hdr tiles/a.png)
    for program in tonemap guided ssao fiv_shadows raindrops photomosaic demo demo_web; do
        [ -x "$dir/$program" ] || { fail "there is no $program"; continue; }
        check_ranges $program
        case $program in
            ssao) check_outputs $program mesh.obj ;;
            fiv_shadows | demo) check_outputs $program in.pfm; check_outputs $program mesh.obj ;;
            *) check_outputs $program in.pfm ;;
        esac
    done
    check_words
    empty "an input has changed" "$(diff <(echo "$sums") <(cd "$ground" && cksum in.pfm in.hdr mesh.obj other.pfm half.hdr tiles/a.png))"
    [ -z "$mounted" ] || umount $mounted
}

# calls_of LIB: the library's functions that stand on standard input, one a line
calls_of() { grep -oE "\\b(sat|$1)_[a-z0-9_]+ ?\(" | tr -d ' (' | sort -u; }

# The first programs: at most 60 lines, one header and nothing else, they run by themselves, and make every call that README
# and the header's USE show.
check_first() {
    local source name shown
    for source in examples/first_*.c; do
        [ -f "$source" ] || continue
        name=$(basename "$source" .c)
        if [ "$(wc -l <"$source")" -le 60 ]; then pass; else fail "$source has more than 60 lines"; fi
        empty "$source includes more than its header and libc" "$(grep '#include' "$source" | grep -vE "<[a-z]+\.h>|\"png\.h\"|\"\.\./${name#first_}\.h\"")"
        lib=${name#first_}
        shown=$({ awk -v n="<!-- $lib -->" '$0 == n { on = 1; next } on && /^```$/ { exit } on' README.md
                  awk '/^ *USE$/ { on = 1; next } on && /^   [A-Z][A-Z ]+$/ { exit } on' "$lib.h"; } | calls_of "$lib")
        if [ -n "$shown" ]; then pass; else fail "README and $lib.h show no calls"; fi
        empty "shown in README or $lib.h and not in $source" "$(comm -23 <(echo "$shown") <(calls_of "$lib" <"$source"))"
        lib=examples
        ok "$source compiles alone" ${CC:-cc} -std=c99 -O2 $DEFS $WARN_C "$source" -o "$dir/$name" $LIBS
        [ -x "$dir/$name" ] || continue
        rm -rf "$dir/first"; mkdir -p "$dir/first"
        ok "$source runs" bash -c "cd $dir/first && timeout 60 ../$name"
        if [ -n "$(find "$dir/first" -name '*.pp?' -o -name '*.png' -size +0)" ]; then pass; else fail "$source writes no picture"; fi
    done
}

# Each is one file that compiles without any package (some use a reference of tests/, which needs -I.), answers --help, and
# refuses what it does not know with a sentence.
check_examples() {
    local source name program text
    dir=build/check/strict/examples
    rm -rf "$dir"; mkdir -p "$dir"
    for source in examples/*.c; do
        [ -f "$source" ] && [[ $source != *_view.c && $source != */first_* ]] || continue
        name=$(basename "$source" .c) program=$dir/$(basename "$source" .c)
        ok "$source compiles alone" ${CC:-cc} -std=c99 -O1 -D_POSIX_C_SOURCE=200809L $DEFS $WARN_C "$source" -o "$program" $LIBS -lpthread -ldl
        [ -x "$program" ] || continue
        if text=$("./$program" --help 2>&1) && grep -q 'usage: ' <<<"$text"; then pass; else fail "$name --help" "$text"; fi
        if text=$("./$program" --no-such-option 2>&1) || [ -z "$text" ]; then fail "$name takes --no-such-option" "$text"; else pass; fi
        if text=$(timeout 60 "./$program" no/such/file.exr "$dir/$name.png" 2>&1) || [ -z "$text" ]; then
            fail "$name takes a file that does not exist" "$text"
        else pass; fi
    done
    check_first
    check_programs
    if have x86_64-w64-mingw32-gcc; then
        for source in examples/{tonemap,photomosaic,raindrops,ssao}.c; do
            ok "$source compiles for Windows" x86_64-w64-mingw32-gcc -std=c99 -O0 -D_POSIX_C_SOURCE=200809L $DEFS -Wall -Werror "$source" -o "$dir/windows.exe" -lm -lpthread
        done
    else skip "no mingw-w64 to compile for Windows"; fi
}
