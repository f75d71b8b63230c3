#!/bin/sh
# Runs test programs, JOBS at a time (default: 2), and ends with the line "N passed, N failed, N skipped".
# A program that dies before it has counted is one failure. usage: tests/run.sh PROGRAM...
# BUILT names programs that need not run, but must be there. With RUNNER="bash tests/check_strict.sh" the arguments are those of that script, one run each.
if [ "$1" = --one ]; then
    log=$(mktemp "$RUN_DIR/log.XXXXXX")
    counts=$log.counts
    if [ -z "$RUNNER" ] && [ ! -x "$2" ]; then
        echo "not ok $2: does not compile"
        echo "0 1 0" >"$counts"
        exit 0
    fi
    EXPECT_COUNTS=$counts timeout "${TEST_TIMEOUT:-300}" $RUNNER "$2" $TEST_ARGS >"$log" 2>&1
    rc=$?
    cat "$log"
    if [ ! -s "$counts" ]; then
        echo "not ok $2: ended with code $rc before it could count its tests"
        echo "0 1 0" >"$counts"
    elif [ $rc -ne 0 ] && awk '{ bad += $2 } END { exit bad ? 1 : 0 }' "$counts"; then
        echo "not ok $2: all tests held, but it ended with code $rc"
        echo "0 1 0" >>"$counts"
    fi
    exit 0
fi
RUN_DIR=$(mktemp -d) && export RUN_DIR
trap 'rm -rf "$RUN_DIR"' EXIT
for program in $BUILT; do
    if [ -x "$program" ]; then echo "1 0 0"; else echo "not ok $program: does not compile" >&2; echo "0 1 0"; fi >>"$RUN_DIR/built.counts"
done
printf '%s\n' "$@" | xargs -P "${JOBS:-2}" -n 1 "$0" --one
cat "$RUN_DIR"/*.counts 2>/dev/null | awk '{ p += $1; f += $2; s += $3 }
    END { printf "%d passed, %d failed, %d skipped\n", p, f, s; exit f || p + s == 0 ? 1 : 0 }'
