#!/bin/bash
# The promises that all headers share: names that other headers take, stack, functions that nobody calls, comments that agree
# with the tables of options; NULL and zero arguments. usage: tests/check_house.sh NAME, or `null` for the arguments of all

lib=$1
. "$(dirname "$0")/check.sh"
family="sat tonemap ssao_sat fiv raindrop softassign"
# no comments, no texts, no shaders
code() {
    ${CC:-cc} -fpreprocessed -dD -E -P -x c "$1" 2>/dev/null | sed "s/\"\([^\"\\\\]\|\\\\.\)*\"//g; s/'[^']*'//g" |
        perl -0pe 's/^(?!#)(.*)\bSAT__GLSL(\((?:[^()]++|(?2))*\))/$1/gm'
}

# Names. The list of words is quick and names each; then compilers prove it, the interface alone and with everything.
check_hostile() {
    local words cc std text
    words=$(sed -n 's/^#define \([A-Za-z0-9_]*\).*/\1/p' tests/hostile.h | paste -sd'|')
    empty names "$(code "$lib.h" | grep -owE "$words" | sort | uniq -c | awk '{ print $2, $1, "times" }')"
    printf '#include "tests/hostile.h"\n#include "%s.h"\n' "$lib" >"$dir/macros.c"
    printf '#include <X11/Xlib.h>\n#include <X11/Xutil.h>\n#include "%s.h"\n' "$lib" >"$dir/x11.c"
    printf '#include <windows.h>\n#include "%s.h"\n' "$lib" >"$dir/windows.c"
    for name in macros x11 windows; do
        cp "$dir/$name.c" "$dir/$name.cpp"
        for cc in gcc g++; do
            [ $name != windows ] || cc=x86_64-w64-mingw32-$cc
            have $cc || { skip "no $cc"; continue; }
            [ $name != x11 ] || echo '#include <X11/Xutil.h>' | $cc -fsyntax-only -x c - 2>/dev/null || { skip "no X11/Xlib.h (libx11-dev)"; continue; }
            std="-std=c99 $dir/$name.c"; [[ $cc != *g++ ]] || std="-std=c++11 $dir/$name.cpp"
            for mode in "" "$IMPL" "$IMPL $GL"; do
                [ "$mode" != "$IMPL" ] || [ $cc = gcc ] || continue
                text=$($cc $std -fsyntax-only -w $DEFS $mode 2>&1 | grep -F "$lib.h:" | grep error | head -3 | tr "\n" " ")
                empty "$name" "${text:+$cc${mode:+ implementation}: $text}"
            done
        done
    done
}

# At most 32 KiB of stack a function: threads of musl have 128 KiB.
check_stack() {
    local opt
    for opt in -O2; do
        ok "compiles $opt" gcc -std=c99 $opt -w -fstack-usage $DEFS -D${LIB}_IMPLEMENTATION= $GL -c "$dir/impl.c" -o "$dir/stack.o"
        empty stack "$(awk -F'\t' '$2 > 32768 { sub(/.*:/, "", $1); print $1 " takes " $2 " bytes of stack" }' "$dir/stack.su")"
    done
}

# Each public function is called by a test, an example or a bench.
check_used() {
    local name
    ok "compiles" gcc -std=c99 -O0 -w $DEFS -D${LIB}_IMPLEMENTATION= $GL -c "$dir/impl.c" -o "$dir/used.o"
    cat tests/test_*.[ch] tests/use_*.c tests/bench/*.[ch]* examples/*.[ch] >"$dir/callers"
    empty unused "$(nm -g --defined-only "$dir/used.o" | awk '$2 == "T" { print $3 }' | grep -v __ | while read -r name; do
        grep -qwF "$name" "$dir/callers" || echo "$name is called by no test, example or bench"; done)"
}

# Each function of OpenGL that a context must have is called.
check_gl() {
    [ "$lib" = sat ] || return
    local name
    code sat.h >"$dir/gl.txt"
    for name in $family; do code "$name.h"; done >"$dir/gl_all.txt"
    empty required "$(awk '/define SAT__GL_FUNCTIONS/ { on = 1 } on { print } on && !/\\$/ { exit }' sat.h | grep -oE 'X\([^,]*, *[A-Za-z0-9_]+' |
        sed 's/.*[ ,]//' | while read -r name; do grep -qE "(->|\.)$name\(" "$dir/gl_all.txt" || echo "$name is required and never called"; done)"
}

# struct comments "default; low..high; words" against the rows SAT__FIELD(struct, type, field, default, low, high, also)
check_comments() {
    local text
    awk -v lib="$lib" '
        function trim(s) { gsub(/^[ \t*]+|[ \t]+$/, "", s); return s }
        function value(s) { return s ~ /^[-+]?[0-9.]+([eE][-+]?[0-9]+)?f?$/ || s ~ /^-?[A-Z][A-Z0-9_]+$/ }
        function same(what, a, b) { printf "    same(\"%s\", (double)(%s), (double)(%s), \"%s\");\n", what, a, b, b }
        /^typedef struct [a-z_0-9]+ \{/ || /^struct [a-z_0-9]+ \{/ { name = $0; sub(/ *\{.*/, "", name); sub(/.* /, "", name); field = ""; next }
        /^\}/ { name = ""; field = "" }
        name != "" && match($0, /[a-z_0-9]+(\[[^]]*\])?; *\/\*/) {
            field = substr($0, RSTART, RLENGTH); sub(/[\[;].*/, "", field)
            words[name, field] = substr($0, RSTART + RLENGTH); next
        }
        name != "" && field != "" && /^ *[^ \/]/ { words[name, field] = words[name, field] " " trim($0) }
        match($0, /SAT__FIELD\([a-z]/) && !/define/ {
            row = substr($0, RSTART + 11); sub(/\),? *(\}.*)?$/, "", row)
            n = split(row, c, / *, */)
            at = c[1] SUBSEP c[3]; what = c[1] "." c[3]
            if (c[2] !~ /[idf]/) next
            if (!(at in words)) { printf "    fault(\"%s has no comment\");\n", what; next }
            text = words[at]; sub(/ *\*\/.*/, "", text)
            m = split(text, part, / *; */)
            first = trim(part[1]); second = trim(part[2]); sub(/ .*/, "", second)
            if (!value(first)) printf "    fault(\"%s: the comment starts with no default: %s\");\n", what, first
            else same(what " default", c[4], first)
            if (m > 1 && split(second, ends, /\.\./) == 2 && value(ends[1]) && value(ends[2])) {
                same(what " low", c[5], ends[1]); same(what " high", c[6], ends[2])
            } else if (c[2] ~ /[df]/) printf "    fault(\"%s: the comment has no range\");\n", what
        }' "$lib.h" >"$dir/rows.txt"
    [ -s "$dir/rows.txt" ] || { skip "no table of options (SAT__FIELD)"; return; }
    { printf '#define LIGHTSCAN_IMPLEMENTATION\n#include "%s.h"\n#include <stdio.h>\n#include <math.h>\n' "$lib"
      echo 'static void fault(const char *text) { puts(text); }'
      echo 'static void same(const char *what, double row, double comment, const char *text) { if (!(row == comment)) printf("%s is %.9g in the table, %s in the comment\n", what, row, text); }'
      echo 'int main(void) {'; echo '    (void)fault; (void)same;'; cat "$dir/rows.txt"; echo '    return 0; }'; } >"$dir/comments.c"
    ok "comments compile" ${CC:-cc} -std=c99 -O0 -w $DEFS $GL "$dir/comments.c" -o "$dir/comments" $LIBS
    empty comments "$("$dir/comments" | sed 's/^\([a-z_0-9.]*\)/\1/')"
}

# One shape in all six, over the prototypes: what a call changes comes first, the object and then the outputs; then what it reads; last
# options and statistics. Statistics are X_stats, by X_get_stats or a last argument. Strings that callbacks get are nobody's business.
check_shape() {
    printf '#include "%s.h"\n' "$lib" >"$dir/shape.c"
    empty shape "$(${CC:-cc} -std=c99 -E -P $DEFS $GL "$dir/shape.c" | tr '\n' ' ' | sed 's/[;}]/&\n/g; s/  */ /g' | awk -v lib="$lib" '
        /typedef struct [a-z_0-9]+ [a-z_0-9]+ *;/ { match($0, /struct [a-z_0-9]+/); opaque[substr($0, RSTART + 7, RLENGTH - 7)] = 1 }
        /^ *extern .*\(.*\) *;/ {
            s = $0; name = s; sub(/\(.*/, "", name); sub(/.*[ *]/, "", name)
            if (index(name, lib "_") != 1 || name ~ /__/) next
            if (name ~ /stat/ && name !~ /_get_stats$/) print name ": statistics come by X_get_stats"
            sub(/^[^(]*\(/, "", s); sub(/\) *;.*/, "", s); n = split(s, arg, / *, */); read = options = ""
            for (i = 1; i <= n; ++i) {
                a = arg[i]; sub(/^ /, "", a)
                word = a; gsub(/const |struct /, "", word); type = word; sub(/[ *].*/, "", type)
                if (options != "" && type !~ /_stats$/) print name ": " a " after " options
                if (a !~ /[*]|\[/ || type ~ /(_fn|_proc)$/ || a ~ /^void \*user$/) continue
                if (a ~ /^const /) { read = a; if (type ~ /_options$/) options = a; continue }
                if (read != "" && type !~ /_stats$/) print name ": " a ", which changes, after " read
                if (type ~ /_stats$/ && i < n) print name ": " a " is not the last"
                if (opaque[type] && a !~ /\*\*/ && i > 1) print name ": " a ", which changes, is not the first"
            }
        }')"
    empty words "$(code "$lib.h" | grep -owE '[a-z_]*_(statistics|report)|vertical_fov|fov_vertical|[a-z_]*_?quantize[a-z]*|dt_seconds|near_distance|depth_range' | sort -u)"
}

# The programs under USE in the first comment are C: each block of lines that are set in by seven blanks, in a function of its own
check_snippets() {
    awk -v include="$dir/include.h" '
        /^   USE/ { on = 1; next }
        on && /^   [A-Z][A-Z ,]+[A-Z]( |$)/ { exit }
        on && /^       #/ { print substr($0, 8) >include; next }
        on && /^       / { if (!code) print "int block_" ++blocks "(void)\n{"; code = 1; print substr($0, 4); next }
        on && /[^ ]/ && code { print "    return 0;\n}\n"; code = 0 }
        END { if (code) print "    return 0;\n}" }' "$lib.h" >"$dir/blocks.c"
    { cat "$dir/include.h"; echo '#include "tests/snippets.h"'; echo 'int block_1(void), block_2(void);'; cat "$dir/blocks.c"; } >"$dir/snippet.c"
    grep -q "block_1(void)$" "$dir/blocks.c" || fail "there is no program under USE"
    ok "the programs under USE compile" gcc -std=c99 -fsyntax-only -Wall -Wextra -Werror -Wno-unused-variable -Wno-unused-but-set-variable $DEFS "$dir/snippet.c"
    ok "and as C++" g++ -std=c++11 -fsyntax-only -Wall -Wextra -Werror -Wno-unused-variable -Wno-unused-but-set-variable -Wno-missing-field-initializers $DEFS -x c++ "$dir/snippet.c"
}

# The list of contents: a line "CONTENTS" in the comments, then lines "   >> name   what it holds". Each name stands once more, as
# the mark of its section, in the same order, and no section has more than 700 lines.
check_contents() {
    grep -q '^ *CONTENTS' "$lib.h" || { skip "there is no list of contents"; return; }
    empty contents "$(awk '
        /^ *CONTENTS/ { listing = 1; next }
        listing && /\*\// { listing = 0 }
        match($0, /^[ \/*-]*>> [A-Za-z][A-Za-z0-9 ,_-]*/) { # not the operator
            name = substr($0, RSTART, RLENGTH); sub(/^[^>]*>> /, "", name); sub(/(  .*| +)$/, "", name)
            if (listing) { want[++n] = name; next }
            if (name != want[++found]) print "section " name " stands where the list says " (found in want ? want[found] : "nothing")
            if (found > 1 && FNR - at > 700) print "section " last " has " FNR - at " lines"
            at = FNR; last = name
        }
        END {
            for (i = found + 1; i <= n; ++i) print "section " want[i] " is in the list only"
            if (at && FNR - at > 700) print "section " last " has " FNR - at " lines"
        }' "$lib.h")"
}

# What users ask first is answered by the interface alone, under a word they search for: picture upside down, threads, what a failed
# create leaves, reversed depth (where there is depth), another radius each frame, pixels into and out of OpenGL, NaN, memory, the
# unit of strides, linear or sRGB.
check_questions() {
    local question words text
    # comments of the interface, on one line
    text=$(sed '/^ *Stop here if you only want to use the library/,$d' "$lib.h" | perl -0ne 's/\s+/ /g for @c = m{/\*.*?\*/}gs; print join " ", @c')
    while IFS='|' read -r question words; do
        [ "$question" != "reversed depth" ] || case $lib in ssao_sat | fiv | raindrop) ;; *) continue ;; esac
        if grep -qE -- "${words//;/|}" <<<"$text"; then pass; else fail "no answer to: $question" "none of $words in the comments of the interface"; fi
    done <<'END'
a picture upside down|bottom row first
threads|[Tt]hreads?
what a create that fails leaves|create that fails
reversed depth|reversed
another radius each frame|each frame;any frame;next frame;every frame;between frames
pixels into and out of OpenGL|On OpenGL [a-z ]+ (come|go|is|are|up)
NaN|NaN
memory|bytes a [a-z]+;[Bb]ytes;MB
the unit of strides|[Ss]trides?[a-z ]* (is|are) (in )?(bytes|floats)
linear or sRGB|sRGB;srgb
END
}

# A function holds one idea: at most 60 lines from its brace to the last.
check_functions() {
    empty "functions of more than 60 lines" "$(awk '
        /^[A-Za-z].*\(/ { name = $0; sub(/\(.*/, "", name); sub(/.*[ *]/, "", name) }
        /^\{$/ { begin = NR }
        /^\}$/ && begin { if (NR - begin > 61) print name " has " NR - begin - 1 " lines"; begin = 0 }' "$lib.h")"
}

# Options change between frames: every OpenGL object has set_options, and structs are compared by their rows, never as
# memory, whose padding is anything.
check_options() {
    empty "X_gl_create without X_gl_set_options" "$(grep -oE "^[A-Z_]+DEF sat_result ${lib}_gl_create\(" "$lib.h" | sort -u | while read -r line; do
        grep -qE "^[A-Z_]+DEF sat_result ${lib}_gl_set_options\(" "$lib.h" || echo "$line"; done)"
    empty "structs compared as memory" "$(code "$lib.h" | grep -E "memcmp *\([^;]*(option|sizeof \*?\(?o\b|_input\b)")"
}

# what vectors and plain C give are the same bits
check_same_bits() {
    local vectors plain o=build/check/house/$lib/same_bits
    case $lib in sat | tonemap | ssao_sat | fiv | raindrop | softassign) ;; *) return ;; esac
    mkdir -p "${o%/*}"
    for how in "" -DSAT_NO_SIMD; do
        ${CC:-cc} -std=c99 -O2 $WARN_C -I. $how -DSAME_BITS_${lib^^} tests/same_bits.c -o "$o$how" -lm || { fail "tests/same_bits.c"; return; }
    done
    vectors=$("$o") plain=$("$o-DSAT_NO_SIMD")
    if [ -n "$plain" ] && [ "$vectors" = "$plain" ]; then pass; else fail "vectors and plain C give other bits" "$vectors"$'\n'"$plain"; fi
}

# every public function, each argument NULL or zero in turn
check_null() {
    dir=build/check/house/null; rm -rf "$dir"; mkdir -p "$dir"
    local flags; flags="-I. -I$dir $(gl_macros $family)"
    printf '#include "%s.h"\n' $family >"$dir/all.c"
    ${CC:-cc} -std=c99 -E -P $flags "$dir/all.c" | tr '\n' ' ' | sed 's/[;}]/&\n/g' | sed 's/  */ /g' | awk -f tests/null_arguments.awk >"$dir/null_arguments.h"
    ok "the table of calls compiles" ${CC:-cc} -std=c99 -O1 -w $flags tests/null_arguments.c -o "$dir/null" $LIBS
    [ "$failed" = 0 ] && empty null "$("./$dir/null")"
    rm -f core
}

if [ "$lib" = null ]; then check_null; finish; fi
setup house
check_hostile
check_stack
check_used
check_gl
check_comments
check_shape
check_snippets
check_contents
check_questions
check_functions
check_options
check_same_bits
finish
