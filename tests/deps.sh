#!/bin/sh
# Installs Debian packages when it may (root, or sudo without a password), else names them in one line.
# Never fails: everything works without them, with fewer features. usage: tests/deps.sh PACKAGE...
missing=
for package; do
    if command -v dpkg-query >/dev/null && dpkg-query -W -f '${Status}' "$package" 2>/dev/null | grep -q 'ok installed'; then
        continue
    fi
    missing="$missing $package"
done
[ -n "$missing" ] || exit 0
if [ -z "$NO_DEPS" ] && command -v apt-get >/dev/null; then
    sudo=
    [ "$(id -u)" = 0 ] || sudo='sudo -n'
    if [ -z "$sudo" ] || $sudo true 2>/dev/null; then
        echo "installing:$missing"
        install() { DEBIAN_FRONTEND=noninteractive timeout 600 $sudo apt-get install -y -qq --no-install-recommends $missing; }
        { install || { timeout 300 $sudo apt-get update -qq && install; }; } >/dev/null 2>&1 && exit 0
    fi
fi
echo "not installed (pictures, OpenGL or checks that need them are left out): apt-get install$missing"
