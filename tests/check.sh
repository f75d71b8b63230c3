# Sourced by the check scripts: counting, and the sources they share. $lib is the header's stem.
cd "$(dirname "${BASH_SOURCE[0]}")/.." || exit 1
passed=0 failed=0 skipped=0
script=$(basename "$0" .sh)

have() { command -v "$1" >/dev/null; }
pass() { passed=$((passed + 1)); }
# the first two failures at length, the others, often of the same cause, in brief
fail() {
    failed=$((failed + 1))
    echo "not ok $lib: $1"
    [ -z "$2" ] || printf '%s\n' "$2" | head -$((failed <= 2 ? 25 : 4)) | sed 's/^/    /'
}
skip() { skipped=$((skipped + 1)); echo "skip $lib: $1"; }
# ok WHAT COMMAND...: the command must succeed, and what it prints is shown when it does not
ok() { local what=$1 text; shift; if text=$("$@" 2>&1); then pass; else fail "$what" "$text"; fi; }
# empty WHAT TEXT: the text lists offences
empty() { if [ -z "$2" ]; then pass; else fail "$1" "$2"; fi; }
finish() {
    echo "$script $lib: $passed passed, $failed failed, $skipped skipped"
    [ -z "$EXPECT_COUNTS" ] || echo "$passed $failed $skipped" >>"$EXPECT_COUNTS"
    [ "$failed" = 0 ]; exit
}

# -D options that implement, or give OpenGL to, these headers
impl_macros() { local l; for l in "$@"; do printf -- '-D%s_IMPLEMENTATION= ' "${l^^}"; done; }
gl_macros() { local l; for l in "$@"; do printf -- '-D%s_GL ' "${l^^}"; done; }

WARN="-Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Wdouble-promotion -Wcast-qual -Wundef -Werror"
WARN_C="$WARN -Wstrict-prototypes -Wmissing-prototypes"
DEFS="-I."
LIBS="-lm"

# setup NAME: a folder in build, tests/use_<lib>.c without its *_IMPLEMENTATION lines, and macros for one header
setup() {
    dir=build/check/$1/$lib
    rm -rf "$dir"; mkdir -p "$dir"
    LIB=${lib^^}
    needs=sat; [ "$lib" = sat ] || needs="sat $lib"
    IMPL=$(impl_macros $needs)
    GL=$(gl_macros $needs)
    printf '#include "%s.h"\n' "$lib" >"$dir/impl.c"
    cp "$dir/impl.c" "$dir/impl.cpp"
    printf '#include "%s.h"\nint main(void) { return !%s_version(); }\n' "$lib" "$lib" >"$dir/version.c"
    if [ -f "tests/use_$lib.c" ]; then
        grep -v '^ *# *define *[A-Z_]*_IMPLEMENTATION' "tests/use_$lib.c" >"$dir/use.c"
    else
        skip "there is no tests/use_$lib.c, only ${lib}_version() is called"
        cp "$dir/version.c" "$dir/use.c"
    fi
    cp "$dir/use.c" "$dir/use.cpp"
}
