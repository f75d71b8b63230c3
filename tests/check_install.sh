#!/bin/bash
# `make install` and the recipes of docs/packaging.md, used by a small program: pkg-config, CMake, Meson; the recipes for vcpkg
# and Conan with stand-ins for their own commands. usage: tests/check_install.sh install
lib=$1
. "$(dirname "$0")/check.sh"
dir=$PWD/build/check/install; rm -rf "$dir"; mkdir -p "$dir"
prefix=$dir/usr
here=$PWD
# block NAME: the code under <!-- NAME -->, with our sources instead of the network
block() { awk -v name="<!-- $1 -->" '$0 == name { on = 1; next } on == 1 && /^```/ { on = 2; next } on == 2 && /^```/ { exit } on == 2' docs/packaging.md |
    sed "s|https://example.org/lightscan.git|$here|"; }
project() { mkdir -p "$1"; cp "$dir/main.c" "$1"; }

cat >"$dir/main.c" <<'C'
#define LIGHTSCAN_IMPLEMENTATION
#include "tonemap.h"
#include "softassign.h"
int main(void) { return tonemap_version() != softassign_version(); }
C
ok "make install" make --no-print-directory install PREFIX="$prefix"
for h in sat tonemap ssao_sat fiv raindrop softassign; do cmp -s $h.h "$prefix/include/$h.h" && pass || fail "$h.h is not installed"; done

if have pkg-config; then
    export PKG_CONFIG_PATH=$prefix/share/pkgconfig
    ok "pkg-config" ${CC:-cc} $(pkg-config --cflags lightscan) "$dir/main.c" -o "$dir/main" $(pkg-config --libs lightscan)
    ok "pkg-config, run" "$dir/main"
else skip "no pkg-config"; fi

if have cmake; then
    for way in installed fetched; do
        project "$dir/$way"
        block "cmake $way" >"$dir/$way/CMakeLists.txt"
        ok "CMake $way" cmake -S "$dir/$way" -B "$dir/$way/build" -DCMAKE_PREFIX_PATH="$prefix" -DFETCHCONTENT_SOURCE_DIR_LIGHTSCAN="$here"
        ok "CMake $way, build" cmake --build "$dir/$way/build"
        ok "CMake $way, run" "$dir/$way/build/example"
    done
    # another major version is refused
    sed 's/lightscan [0-9.]* REQUIRED/lightscan 99.0 REQUIRED/' "$dir/installed/CMakeLists.txt" >"$dir/x" && mkdir -p "$dir/wrong" && cp "$dir/main.c" "$dir/wrong" && mv "$dir/x" "$dir/wrong/CMakeLists.txt"
    if cmake -S "$dir/wrong" -B "$dir/wrong/build" -DCMAKE_PREFIX_PATH="$prefix" >/dev/null 2>&1; then fail "CMake takes version 99"; else pass; fi
    { echo "set(PORT lightscan)"; echo "set(CURRENT_PACKAGES_DIR \"$dir/vcpkg\")"
      echo "macro(vcpkg_from_git)"; echo "set(SOURCE_PATH \"$here\")"; echo "endmacro()"
      echo 'function(vcpkg_replace_string file from to)'; echo 'file(READ "${file}" text)'; echo 'string(REPLACE "${from}" "${to}" text "${text}")'; echo 'file(WRITE "${file}" "${text}")'; echo 'endfunction()'
      echo 'function(vcpkg_install_copyright)'; echo 'endfunction()'; block "vcpkg portfile"; } >"$dir/portfile.cmake"
    ok "vcpkg's portfile" cmake -P "$dir/portfile.cmake"
    project "$dir/vcpkg_user"; sed 's/lightscan [0-9.]* REQUIRED/lightscan REQUIRED/' "$dir/installed/CMakeLists.txt" >"$dir/vcpkg_user/CMakeLists.txt"
    ok "vcpkg's package by CMake" cmake -S "$dir/vcpkg_user" -B "$dir/vcpkg_user/build" -Dlightscan_DIR="$dir/vcpkg/share/lightscan"
    ok "vcpkg's package, build" cmake --build "$dir/vcpkg_user/build"
else skip "no cmake"; fi

if have meson && have ninja; then
    project "$dir/meson"; mkdir -p "$dir/meson/subprojects/packagefiles/lightscan" "$dir/meson/subprojects/lightscan"
    block "meson wrap" >"$dir/meson/subprojects/lightscan.wrap"
    block "meson build" >"$dir/meson/subprojects/packagefiles/lightscan/meson.build"
    block "meson user" >"$dir/meson/meson.build"
    cp ./*.h "$dir/meson/subprojects/packagefiles/lightscan/meson.build" "$dir/meson/subprojects/lightscan"   # as the wrap would
    ok "Meson" meson setup "$dir/meson/build" "$dir/meson"
    ok "Meson, build" ninja -C "$dir/meson/build"
    ok "Meson, run" "$dir/meson/build/example"
else skip "no meson or ninja (meson, ninja-build)"; fi

if have python3; then
    block conan >"$dir/conanfile.py"
    # stand-ins for the parts of Conan that the recipe asks for; the package is then used by the compiler
    mkdir -p "$dir/conan/conan/tools" "$dir/conan/package"
    echo 'class ConanFile: pass' >"$dir/conan/conan/__init__.py"; : >"$dir/conan/conan/tools/__init__.py"
    printf '%s\n' 'import os, shutil' 'def get(*a, **k): pass' 'def copy(recipe, name, src, dst):' '    os.makedirs(dst, exist_ok=True)' \
        '    shutil.copy(os.path.join(src, name), dst)' >"$dir/conan/conan/tools/files.py"
    printf '%s\n' 'import sys' 'sys.path.insert(0, sys.argv[1])' 'from types import SimpleNamespace as S' 'from conanfile import LightscanConan as C' \
        'c = C(); c.source_folder, c.package_folder = sys.argv[2], sys.argv[1] + "/package"' 'c.settings = S(os="Linux"); c.cpp_info = S(); c.info = S(clear=lambda: None)' \
        'c.package(); c.package_id(); c.package_info(); assert c.cpp_info.system_libs == ["m"] and not c.cpp_info.libdirs' >"$dir/conan/run.py"
    cp "$dir/conanfile.py" "$dir/conan"
    ok "Conan's recipe" python3 "$dir/conan/run.py" "$dir/conan" "$here"
    ok "Conan's package" ${CC:-cc} -I"$dir/conan/package/include" "$dir/main.c" -o "$dir/conan/main" -lm
    ok "Conan's package has the licence" test -s "$dir/conan/package/licenses/LICENSE"
    block "conan test" >"$dir/conan/test.py"; ok "Conan's test is Python" python3 -m py_compile "$dir/conan/test.py"
    version=$(awk '/define SAT_VERSION_(MAJOR|MINOR|PATCH)/ { printf "%s%s", dot, $3; dot = "." }' sat.h)
    for block in "conan data" "conan config" "vcpkg json"; do
        if block "$block" | grep -q "\"$version\""; then pass; else fail "the version under $block is not $version, that of sat.h"; fi
    done
    block "vcpkg json" >"$dir/vcpkg.json"
    ok "vcpkg.json" python3 -m json.tool "$dir/vcpkg.json"
else skip "no python3"; fi
finish
