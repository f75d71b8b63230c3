#!/bin/bash
# libFuzzer with both sanitizers on tests/fuzz_<lib>.c for FUZZ_SECONDS. usage: tests/check_fuzz.sh NAME
lib=$1
. "$(dirname "$0")/check.sh"
dir=build/fuzz; mkdir -p "$dir/corpus_$lib"
if ! have clang; then skip "no clang"
elif [ ! -f "tests/fuzz_$lib.c" ]; then skip "there is no tests/fuzz_$lib.c"
else
    if text=$(clang -std=c99 -g -O1 -fsanitize=fuzzer,address,undefined -fno-sanitize-recover=all -D_POSIX_C_SOURCE=200809L \
            $DEFS -Itests "tests/fuzz_$lib.c" -o "$dir/fuzz_$lib" $LIBS 2>&1); then
        pass
        if text=$("$dir/fuzz_$lib" -max_total_time="${FUZZ_SECONDS:-20}" -timeout=10 -rss_limit_mb=2048 -malloc_limit_mb=1024 \
                -artifact_prefix="$dir/${lib}_" "$dir/corpus_$lib" 2>&1); then
            pass
            tail -1 <<<"$text"
        else fail "fuzz_$lib" "$(grep -vE '^#[0-9]' <<<"$text")"; fi
    else fail "compile fuzz_$lib.c" "$text"; fi
fi
finish
