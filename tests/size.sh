#!/bin/bash
# Bytes of machine code and constants of each header at -Os: whole, with OpenGL, and without each option.
# Prints a table that `make report` reads too. usage: [QUICK=1] [SMOKE=1] tests/size.sh NAME...
# QUICK=1: whole, and all options together. SMOKE=1: without the optimiser besides, to see that it works.
lib=
. "$(dirname "$0")/check.sh"
mkdir -p build/size
size=-Os; [ -z "$SMOKE" ] || size=-O0
measure() { ${CC:-cc} -std=c99 $size -DNDEBUG $DEFS "$@" -c build/size/x.c -o build/size/x.o 2>/dev/null && size build/size/x.o | awk 'NR == 2 { print $1 }'; }
echo "# table: Object size by option (bytes of code and constants at -Os)"
printf 'header\tconfiguration\tbytes\tsaved\tdefault\n'
for lib in "$@"; do
    LIB=${lib^^}
    printf '#include "%s.h"\n' "$lib" >build/size/x.c
    own=-D${LIB}_IMPLEMENTATION
    whole=$(measure "$own")
    with_gl=$whole
    [ -n "$QUICK$SMOKE" ] || with_gl=$(measure "$own" "-D${LIB}_GL" -DSAT_GL)
    printf '%s\twhole\t%s\t0\t1\n' "$lib" "$whole"
    [ "$whole" = "$with_gl" ] || printf '%s\twith %s_GL\t%s\t%s\t0\n' "$lib" "$LIB" "$with_gl" "$((whole - with_gl))"
    all=
    for macro in $(grep -oE "\b${LIB}_NO_[A-Z0-9_]+" "$lib.h" | sort -u) SAT_NO_SIMD; do
        [ "$macro" != "${LIB}_NO_STDLIB" ] || continue
        [ "$macro" != SAT_NO_SIMD ] || [[ " $all" != *" -DSAT_NO_SIMD"* ]] || continue
        all="$all -D$macro"
        [ -z "$QUICK$SMOKE" ] || continue
        bytes=$(measure "$own" "-D$macro")
        if [ "$bytes" = "$whole" ]; then  # an option of the OpenGL part
            bytes=$(measure "$own" "-D$macro" "-D${LIB}_GL" -DSAT_GL)
            printf '%s\twith %s_GL, %s\t%s\t%s\t0\n' "$lib" "$LIB" "$macro" "$bytes" "$((with_gl - bytes))"
        else
            printf '%s\t%s\t%s\t%s\t0\n' "$lib" "$macro" "$bytes" "$((whole - bytes))"
        fi
    done
    bytes=$(measure "$own" $all)
    printf '%s\teverything left out\t%s\t%s\t0\n' "$lib" "$bytes" "$((whole - bytes))"
done
