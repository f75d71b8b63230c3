#!/bin/bash
# Other processors and compilers: tests of one header on aarch64 under qemu-user, warnings and code for Windows (mingw-w64),
# 32 bit, and tcc. usage: tests/check_compilers.sh NAME
lib=$1
. "$(dirname "$0")/check.sh"
setup compilers

if have aarch64-linux-gnu-gcc; then
    ok "aarch64" aarch64-linux-gnu-gcc -std=c99 -O2 $WARN_C $DEFS $IMPL $GL "$dir/use.c" -o "$dir/use_arm" $LIBS
    qemu=$(command -v qemu-aarch64 || command -v qemu-aarch64-static)
    if [ -z "$qemu" ]; then skip "no qemu-aarch64 (qemu-user)"
    else
        qemu="$qemu -L /usr/aarch64-linux-gnu"
        ok "aarch64 runs" $qemu "./$dir/use_arm"
        for test in tests/test_"$lib".c; do
            [ -f "$test" ] || continue
            ok "aarch64: $test" aarch64-linux-gnu-gcc -std=c99 -O2 -D_POSIX_C_SOURCE=200809L $DEFS -Itests -Iexamples \
                "$test" -o "$dir/test_arm" $LIBS -lpthread -ldl
            text=$(LIGHTSCAN_GL=none EXPECT_COUNTS= timeout 900 $qemu "./$dir/test_arm" 2>&1) && pass || fail "aarch64: run $test" "$text"
        done
    fi
else skip "no aarch64-linux-gnu-gcc (gcc-aarch64-linux-gnu)"; fi

if have x86_64-w64-mingw32-gcc; then
    ok "mingw-w64" x86_64-w64-mingw32-gcc -std=c99 -O2 $WARN_C $DEFS $IMPL $GL "$dir/use.c" -o "$dir/use.exe" $LIBS
    if have x86_64-w64-mingw32-g++; then
        ok "mingw-w64 C++" x86_64-w64-mingw32-g++ -std=c++11 -O2 $WARN $DEFS $IMPL $GL "$dir/use.cpp" -o "$dir/use_cxx.exe" $LIBS
    fi
else skip "no x86_64-w64-mingw32-gcc (gcc-mingw-w64-x86-64)"; fi

if echo 'int main(void){return 0;}' | gcc -m32 -x c - -o "$dir/probe" 2>/dev/null && "./$dir/probe"; then
    ok "32 bit" gcc -m32 -std=c99 -O2 $WARN_C $DEFS $IMPL $GL "$dir/use.c" -o "$dir/use32" $LIBS
    ok "32 bit runs" "./$dir/use32"
else skip "no 32-bit libraries (gcc-multilib)"; fi

if have tcc; then
    ok "tcc" tcc -DSAT_NO_SIMD $DEFS $IMPL $GL "$dir/use.c" -o "$dir/use_tcc" $LIBS
    ok "tcc runs" "./$dir/use_tcc"
else skip "no tcc"; fi
finish
