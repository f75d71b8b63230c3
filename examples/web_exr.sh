#!/bin/sh
# OpenEXR's C library and zlib for WebAssembly: FOLDER/libexr.a, from the distribution's sources. usage: examples/web_exr.sh FOLDER
# Needs emcc, apt-get and the headers of libopenexr-dev. The sources come through apt-get with lists of its own below
# FOLDER, so that the system's stay as they are and nothing is installed. NO_DEPS=1 fetches nothing.
folder=$1 emcc=${EMCC:-emcc}
[ ! -f "$folder/libexr.a" ] || exit 0

without() { echo "the page will read no .exr: $1"; exit 0; }
[ -z "$NO_DEPS" ] || without "NO_DEPS is set, the sources of OpenEXR were not fetched"
command -v apt-get >/dev/null || without "no apt-get to fetch the sources of OpenEXR"
[ -f /usr/include/OpenEXR/openexr.h ] && [ -f /usr/include/Imath/half.h ] || without "no OpenEXR headers: apt-get install libopenexr-dev"

rm -rf "$folder/exr"
mkdir -p "$folder/include" "$folder/exr/lists/partial" "$folder/exr/archives/partial" || exit 1
ln -sfn /usr/include/OpenEXR "$folder/include/OpenEXR" && ln -sfn /usr/include/Imath "$folder/include/Imath" && cd "$folder/exr" || exit 1
apt-get indextargets --format 'deb-src $(REPO_URI) $(CODENAME) $(COMPONENT)' 'Created-By: Packages' 'Origin: Debian' | grep -v security | sort -u >sources.list
apt() {
    timeout 300 apt-get -qq -o Dir::Etc::SourceList="$PWD/sources.list" -o Dir::Etc::SourceParts=/dev/null -o Dir::State::Lists="$PWD/lists" \
        -o Dir::Cache="$PWD" -o APT::Sandbox::User="$(id -un)" -o Acquire::http::Timeout=20 "$@" >>log 2>&1
}
apt update && apt source --download-only openexr zlib || without "the sources of OpenEXR could not be fetched ($(tail -1 log))"
rm -f ./*.asc
for file in openexr_*.orig.tar.*; do tar xf "$file" --strip-components=3 --wildcards '*/src/lib/OpenEXRCore/*.[ch]'; done
mkdir zlib && for file in zlib_*.orig.tar.*; do tar xf "$file" -C zlib --strip-components=1; done

# half floats without their table, which is a file of Imath's library; of zlib what works in memory
{ "$emcc" -w -O2 -D_GNU_SOURCE -DIMATH_HALF_NO_LOOKUP_TABLE -I../include/OpenEXR -I../include/Imath -Izlib -c OpenEXRCore/*.c &&
  "$emcc" -w -O2 -c zlib/adler32.c zlib/compress.c zlib/crc32.c zlib/deflate.c zlib/inffast.c zlib/inflate.c zlib/inftrees.c zlib/trees.c \
      zlib/uncompr.c zlib/zutil.c && "${emcc%cc}ar" rcs libexr.a ./*.o; } >>log 2>&1 || without "OpenEXR did not compile ($(tail -1 log))"
mv libexr.a .. && cd .. && rm -rf exr
