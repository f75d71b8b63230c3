#!/bin/bash
# Static analysis of one header: gcc -fanalyzer, and clang --analyze, which passes over headers unless told.
# usage: tests/check_analyze.sh NAME
lib=$1
. "$(dirname "$0")/check.sh"
setup analyze
IMPL=$(impl_macros "$lib")       # sat.h has a run of its own

if gcc -fanalyzer -fsyntax-only -x c /dev/null 2>/dev/null; then
    ok "gcc -fanalyzer" gcc -std=c99 -O1 -fanalyzer -Werror $DEFS $IMPL $GL -c "$dir/use.c" -o "$dir/use.o"
else
    skip "gcc has no -fanalyzer (gcc 10 or newer)"
fi
if have clang; then
    for mode in "" -DSAT_NO_SIMD; do
        text=$(clang --analyze -Xanalyzer -analyzer-opt-analyze-headers -Xanalyzer -analyzer-output=text \
            -std=c99 $DEFS $IMPL $GL $mode "$dir/use.c" -o "$dir/use.plist" 2>&1 | grep -E 'warning:|error:')
        empty "clang --analyze $mode" "$text"
    done
else
    skip "no clang"
fi
finish
