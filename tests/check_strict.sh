#!/bin/bash
# The compile-time promises of one header, or of all together.
# usage: tests/check_strict.sh NAME
# NAME: sat, tonemap, ...; or family (all headers together), dist (one-file editions), examples
#
# tests/use_<lib>.c is a whole program that calls functions of the header and returns 0; lines of it that define
# *_IMPLEMENTATION are taken out here, because who implements what is the subject of these checks.

lib=$1
. "$(dirname "$0")/check.sh"
family="sat tonemap ssao_sat fiv raindrop softassign"

# Left out of -Weverything: padding, and what C99 or C++98 would rather see written otherwise.
EVERYTHING="-Weverything -Werror -Wno-padded -Wno-declaration-after-statement -Wno-float-equal -Wno-switch-enum
    -Wno-covered-switch-default -Wno-reserved-id-macro -Wno-reserved-identifier -Wno-unknown-warning-option
    -Wno-unsafe-buffer-usage -Wno-disabled-macro-expansion"
EVERYTHING_CXX="$EVERYTHING -Wno-c++98-compat-pedantic -Wno-old-style-cast -Wno-zero-as-null-pointer-constant"

# ---- one header ------------------------------------------------------------------------------------------------

# Strict warnings in every language version, through the optimiser once for each compiler (some warnings need it), with
# and without vectors; and what was compiled must run.
check_matrix() {
    local cc std o=$dir/use simd=-DSAT_NO_SIMD
    for cc in gcc clang; do
        have $cc || { skip "no $cc"; continue; }
        ok "$cc -O2" $cc -std=c99 -O2 $WARN_C $DEFS $IMPL $GL "$dir/use.c" -o $o $LIBS
        ok "the program runs ($cc)" ./$o
        ok "$cc without OpenGL" $cc -std=c99 -fsyntax-only $WARN_C $DEFS $IMPL "$dir/use.c"
        for std in c11 c17; do
            ok "$cc -std=$std" $cc -std=$std -fsyntax-only $WARN_C $DEFS $IMPL $GL "$dir/use.c"
        done
        [ "$(uname -m)" != x86_64 ] ||
            ok "$cc AVX2" $cc -std=c99 -fsyntax-only -mavx2 -mfma $WARN_C $DEFS $IMPL $GL "$dir/use.c"
        ok "$cc $simd" $cc -std=c99 -fsyntax-only $WARN_C $DEFS $IMPL $GL $simd "$dir/use.c"
    done
    ok "$simd" ${CC:-cc} -std=c99 -O1 $WARN_C $DEFS $IMPL $simd -DNDEBUG "$dir/use.c" -o $o $LIBS
    ok "the program runs ($simd)" ./$o
    for cc in g++ clang++; do
        have $cc || { skip "no $cc"; continue; }
        ok "$cc -std=c++11" $cc -std=c++11 -O1 $WARN $DEFS $IMPL $GL "$dir/use.cpp" -o $o $LIBS
        ok "the program runs ($cc)" ./$o
        ok "$cc -std=c++17" $cc -std=c++17 -fsyntax-only $WARN $DEFS $IMPL $GL "$dir/use.cpp"
    done
    if have clang; then
        ok "clang -Weverything" clang -std=c99 -fsyntax-only $EVERYTHING $DEFS $IMPL $GL "$dir/impl.c"
        ok "clang -Weverything NO_SIMD" clang -std=c99 -fsyntax-only $EVERYTHING $DEFS $IMPL -DSAT_NO_SIMD "$dir/impl.c"
        ok "clang++ -Weverything" clang++ -std=c++17 -fsyntax-only $EVERYTHING_CXX $DEFS $IMPL $GL "$dir/impl.cpp"
    fi
}

# Who implements what, and where.
check_linkage() {
    local cc="${CC:-cc} -std=c99 -O0 $DEFS $GL -Werror" own=-D${LIB}_IMPLEMENTATION= symbol text
    # the interface alone, sat.h and the header implemented in files of their own
    echo '#include "sat.h"' >"$dir/sat.c"
    if [ "$lib" = sat ]; then objects=$dir/sat.o; else objects="$dir/sat.o $dir/impl.o"; fi
    ok "interface alone" $cc -c "$dir/use.c" -o "$dir/use.o"
    ok "sat.h implemented alone" $cc -DSAT_IMPLEMENTATION -c "$dir/sat.c" -o "$dir/sat.o"
    [ "$lib" = sat ] || ok "implemented without sat.h" $cc $own -c "$dir/impl.c" -o "$dir/impl.o"
    ok "parts link" ${CC:-cc} "$dir/use.o" $objects -o "$dir/parts" $LIBS
    ok "parts run" "./$dir/parts"
    if have "${CXX:-c++}"; then
        ok "C++ interface" ${CXX:-c++} -std=c++11 $DEFS $GL -c "$dir/use.cpp" -o "$dir/use_cxx.o"
        ok "C++ program links C implementation" ${CXX:-c++} "$dir/use_cxx.o" $objects -o "$dir/mixed" $LIBS
        ok "C++ program with C implementation runs" "./$dir/mixed"
    fi
    # LIGHTSCAN_IMPLEMENTATION implements all that is included; a second inclusion changes nothing
    printf '#define LIGHTSCAN_IMPLEMENTATION\n#include "%s.h"\n#include "sat.h"\n#include "%s.h"\n' "$lib" "$lib" >"$dir/twice.c"
    ok "LIGHTSCAN_IMPLEMENTATION, included twice" $cc "$dir/use.o" "$dir/twice.c" -o "$dir/twice" $LIBS
    # private copies in two files of one program
    local private="-D${LIB}_STATIC -DSAT_STATIC $IMPL -Wno-unused-function"
    ok "static copy 1" $cc $private -c "$dir/use.c" -o "$dir/static1.o"
    ok "static copy 2" $cc $private -Dmain=another_main -c "$dir/use.c" -o "$dir/static2.o"
    ok "two static copies link" ${CC:-cc} "$dir/static1.o" "$dir/static2.o" -o "$dir/static" $LIBS
    ok "two static copies run" "./$dir/static"
    text=$(nm -g --defined-only "$dir/static1.o" | awk '$3 != "main" { print $3 }')
    empty "${LIB}_STATIC leaves external symbols" "$text"
    # a program that forgets SAT_IMPLEMENTATION is told so by the linker
    symbol=sat__define_SAT_IMPLEMENTATION_in_exactly_one_c_file
    [ "$lib" = sat ] && forgotten="" || forgotten=$dir/impl.o
    if text=$(${CC:-cc} "$dir/use.o" $forgotten -o "$dir/forgotten" $LIBS 2>&1); then
        fail "links without SAT_IMPLEMENTATION"
    elif [ -z "$forgotten" ] || grep -q "$symbol" <<<"$text"; then pass
    else fail "the link error without SAT_IMPLEMENTATION does not name $symbol" "$text"; fi
    # ... and so is one that implements nothing at all
    text=$(${CC:-cc} "$dir/use.o" -o "$dir/forgotten" $LIBS 2>&1)
    if ! ${CC:-cc} -dM -E -x c /dev/null 2>/dev/null | grep -q __GNUC__ || grep -q "$symbol" <<<"$text"; then pass
    else fail "the link error without any implementation does not name $symbol" "$text"; fi
    # both implemented twice: a link error, never a silent choice
    ok "second implementation" $cc -D${LIB}_IMPLEMENTATION= -c "$dir/impl.c" -o "$dir/impl2.o"
    if ${CC:-cc} "$dir/use.o" $objects "$dir/impl2.o" -o "$dir/double" $LIBS 2>/dev/null; then
        fail "two implementations link"
    else pass; fi
}

# Names: external symbols, undefined ones, writable data, macros.
check_names() {
    local obj=$dir/names.o text
    ok "object for nm" ${CC:-cc} -std=c99 -O1 -fno-pic -fno-pie $DEFS $GL -D${LIB}_IMPLEMENTATION= -c "$dir/impl.c" -o "$obj"
    text=$(nm -g --defined-only "$obj" | awk -v p="${lib}_" '$3 !~ "^" p { print $3 }')
    empty "external symbols without the prefix ${lib}_" "$text"
    text=$(nm --undefined-only "$obj" | awk '{ print $NF }' | grep -E '^(gl[A-Z]|egl|OSMesa|pthread)')
    empty "symbols of GL or threads" "$text"
    text=$(nm "$obj" | awk '$2 ~ /^[bBdDCgGsS]$/ { print $2, $3 }')
    empty "writable data" "$text"
    # macros that appear, less those of the system headers that the implementation may include
    printf '#include <%s>\n' stddef.h stdint.h stdio.h stdlib.h string.h math.h assert.h float.h limits.h >"$dir/before.c"
    echo '#ifdef __SSE2__
#include <emmintrin.h>
#include <immintrin.h>
#endif' >>"$dir/before.c"
    cat "$dir/before.c" "$dir/impl.c" >"$dir/after.c"
    for mode in "" "$IMPL"; do
        text=$(diff <(${CC:-cc} -std=c99 -dM -E $DEFS $mode $GL "$dir/before.c" | sort) \
                    <(${CC:-cc} -std=c99 -dM -E $DEFS $mode $GL "$dir/after.c" | sort) |
               sed -n 's/^[<>] *#define \([A-Za-z0-9_]*\).*/\1/p' | grep -vE "^(SAT|$LIB)_" | sort -u)
        empty "macros without a prefix${mode:+ (implementation)}" "$text"
    done
}

# What an option leaves out must leave the rest whole: each alone, then all at once.
check_options() {
    local all="" macro flags
    for macro in $(grep -oE "\b${LIB}_NO_[A-Z0-9_]+" "$lib.h" | sort -u); do
        flags="-std=c99 -O0 $WARN_C $DEFS $IMPL $GL -D$macro"
        if [ "$macro" = "${LIB}_NO_STDLIB" ]; then
            ok "$macro compiles" ${CC:-cc} $flags -DSAT_NO_STDLIB -c "$dir/impl.c" -o "$dir/no.o"
            text=$(nm --undefined-only "$dir/no.o" 2>/dev/null | awk '{ print $NF }' | grep -E '^(malloc|calloc|realloc|free|abort|qsort|getenv)$')
            empty "$macro still calls" "$text"
        else
            all="$all -D$macro"
            ok "$macro links" ${CC:-cc} $flags "$dir/version.c" -o "$dir/no" $LIBS
        fi
    done
    [ -z "$all" ] || ok "all options off" ${CC:-cc} -std=c99 -O0 $WARN_C $DEFS $IMPL $GL $all "$dir/version.c" -o "$dir/no" $LIBS
}

# Functions of more than 60 lines are listed, of more than 80 refused.
check_length() {
    local text
    text=$(awk '/^[A-Za-z].*[^;]$/ || /^[A-Za-z].*\($/ { head = $0; at = FNR }
        /^\{/ { start = FNR }
        /^\}/ && start { n = FNR - start - 1; if (n > 60) print n, "lines, line " at ": " head; start = 0 }' "$lib.h")
    [ -z "$text" ] || printf 'long functions in %s.h:\n%s\n' "$lib" "$(sed 's/^/    /' <<<"$text")"
    if ! awk '$1 > 80 { bad = 1 } END { exit !bad }' <<<"$text"; then pass; else fail "functions of more than 80 lines"; fi
}

check_one() {
    setup strict
    ok "compiles at all" ${CC:-cc} -std=c99 -fsyntax-only $DEFS $IMPL "$dir/use.c"
    [ "$failed" = 0 ] || finish
    check_matrix
    check_linkage
    check_names
    check_options
    check_length
    finish
}

# ---- all headers together --------------------------------------------------------------------------------------

# A header reacts to what came before it, so every ordered pair, once and repeated, stands for every order; rotations
# of the whole row, forwards and backwards, are implemented and linked as well.
check_family() {
    dir=build/check/strict/family
    rm -rf "$dir"; mkdir -p "$dir"
    local a b n i rows libs=() text
    for a in $family; do [ -f "$a.h" ] && libs+=("$a"); done
    for a in "${libs[@]}"; do
        for b in "${libs[@]}"; do
            printf '#include "%s.h"\n#include "%s.h"\n#include "%s.h"\nint main(void) { return !(%s_version() && %s_version()); }\n' \
                "$a" "$b" "$a" "$a" "$b" >"$dir/pair.c"
            ok "include $a.h, $b.h" ${CC:-cc} -std=c99 -fsyntax-only $WARN_C $DEFS $(gl_macros $a $b) "$dir/pair.c"
        done
    done
    n=${#libs[@]}
    for ((i = 0; i < n; ++i)); do
        rows=("${libs[@]:i}" "${libs[@]:0:i}")
        printf '#include "%s.h"\n' "${rows[@]}" >"$dir/forward.c"
        for ((b = n - 1; b >= 0; --b)); do printf '#include "%s.h"\n' "${rows[b]}"; done >"$dir/backward.c"
        { printf 'int main(void) { return 0'; printf ' + !%s_version()' "${libs[@]}"; echo '; }'; } >"$dir/main.txt"
        for a in forward backward; do
            cat "$dir/main.txt" >>"$dir/$a.c"
            ok "implement in order ${rows[*]} ($a)" ${CC:-cc} -std=c99 -O0 $WARN_C $DEFS $(gl_macros "${libs[@]}") \
                -DLIGHTSCAN_IMPLEMENTATION "$dir/$a.c" -o "$dir/order" $LIBS
            ok "run in order ${rows[*]} ($a)" "./$dir/order"
        done
    done
    if have "${CXX:-c++}"; then
        cp "$dir/forward.c" "$dir/forward.cpp"
        ok "all in one C++ file" ${CXX:-c++} -std=c++11 -O0 $WARN $DEFS $(gl_macros "${libs[@]}") -DLIGHTSCAN_IMPLEMENTATION \
            "$dir/forward.cpp" -o "$dir/order" $LIBS
        ok "all in one C++ file, run" "./$dir/order"
    fi
    text=$(grep -lE '/work/|/home/|/root/' ./*.h examples/*.[ch] tests/*.[ch] tests/*.cpp tests/bench/*.[ch]* Makefile 2>/dev/null)
    empty "paths of one machine" "$text"
    finish
}

# ---- one-file editions -----------------------------------------------------------------------------------------

# Each edition alone with strict warnings; all of them in one file; each implemented in a file of its own, linked into
# one program whose main sees the interfaces only.
check_dist() {
    local a LIB GL text libs=() objects=() inc=build/check/strict/dist/include
    dir=build/check/strict/dist
    rm -rf "$dir"; mkdir -p "$inc"
    for a in $family; do
        [ -f "$a.h" ] && [ "$a" != sat ] || continue
        libs+=("$a")
        if text=$(awk -f tests/make_dist.awk sat.h "$a.h" 2>&1 >"$inc/$a.h"); then pass; else fail "$a: edition" "$text"; fi
    done
    for a in "${libs[@]}"; do
        LIB=${a^^} GL=-D${a^^}_GL
        # the interface first, as from a user's own header, then the implementation
        printf '#include "%s.h"\n#define %s_IMPLEMENTATION\n#include "%s.h"\n' "$a" "$LIB" "$a" >"$dir/$a.c"
        cp "$dir/$a.c" "$dir/$a.cpp"
        printf '#include "%s.h"\n' "$a" >"$dir/api.c"
        ok "$a: interface" ${CC:-cc} -std=c99 -O1 $WARN_C -I"$inc" $GL -c "$dir/api.c" -o "$dir/api.o"
        empty "$a: the interface compiles to code" "$(nm "$dir/api.o" | awk '$2 ~ /^[tTdDbB]$/ { print $3 }')"
        ok "$a: edition, plain" ${CC:-cc} -std=c99 -O1 $WARN_C -I"$inc" -c "$dir/$a.c" -o "$dir/$a.o"
        ok "$a: edition" ${CC:-cc} -std=c99 -O1 $WARN_C -I"$inc" $GL -c "$dir/$a.c" -o "$dir/$a.o"
        empty "$a: external symbols without the prefix" "$(nm -g --defined-only "$dir/$a.o" | awk -v p="^${a}_" '$3 !~ p { print $3 }')"
        objects+=("$dir/$a.o")
        ! have clang || ok "$a: edition, clang" clang -std=c99 -fsyntax-only $WARN_C -I"$inc" $GL "$dir/$a.c"
        ! have "${CXX:-c++}" || ok "$a: edition, C++" ${CXX:-c++} -std=c++11 -fsyntax-only $WARN -I"$inc" $GL "$dir/$a.cpp"
        if [ -f "tests/use_$a.c" ]; then
            grep -vE '^ *# *(define *[A-Z_]*_IMPLEMENTATION|include *"sat.h")' "tests/use_$a.c" >"$dir/use.c"
            ok "$a: program" ${CC:-cc} -std=c99 -O1 $WARN_C -I"$inc" -D${LIB}_IMPLEMENTATION= "$dir/use.c" -o "$dir/use" $LIBS
            ok "$a: program runs" "./$dir/use"
        fi
    done
    [ "${#libs[@]}" -gt 0 ] || { skip "no header besides sat.h"; finish; }
    printf '#include "%s.h"\n' "${libs[@]}" >"$dir/main.c"
    { printf 'int main(void) { return 0'; printf ' + !%s_version()' "${libs[@]}"; echo '; }'; } >>"$dir/main.c"
    cp "$dir/main.c" "$dir/main.cpp"
    ok "editions in files of one program" ${CC:-cc} -std=c99 $WARN_C -I"$inc" "$dir/main.c" "${objects[@]}" -o "$dir/many" $LIBS
    ok "editions in files of one program, run" "./$dir/many"
    ok "editions in one file" ${CC:-cc} -std=c99 $WARN_C -I"$inc" -DLIGHTSCAN_IMPLEMENTATION $(gl_macros "${libs[@]}") "$dir/main.c" -o "$dir/one" $LIBS
    ok "editions in one file, run" "./$dir/one"
    if have "${CXX:-c++}"; then
        ok "editions in one C++ file" ${CXX:-c++} -std=c++11 $WARN -I"$inc" -DLIGHTSCAN_IMPLEMENTATION "$dir/main.cpp" -o "$dir/one" $LIBS
        ok "editions in one C++ file, run" "./$dir/one"
    fi
    finish
}

# ---- examples --------------------------------------------------------------------------------------------------

. tests/check_examples.sh
examples() {
    check_examples
    local page target
    for page in README.md docs/*.md; do
        empty "$page shows other programs than tests/test_readme.h (make docs)" "$(diff "$page" <(sh tests/readme.sh "$page"))"
        # every link to a file leads somewhere
        empty "$page: links to nothing" "$(grep -oE '(\]\(|src=")[^)#"]+' "$page" | sed -E 's/^(]\(|src=")//' | grep -v '^http' | while read -r target; do
            [ -e "$(dirname "$page")/$target" ] || echo "$target"; done)"
    done
    finish
}

case $lib in
    family) check_family ;;
    dist) check_dist ;;
    examples) examples ;;
    *) check_one ;;
esac
