#!/bin/bash
# Every shader of a header, in every combination of the options that reach one, through the reference compiler, as GLSL 3.30 and
# GLSL ES 3.00 (compute shaders: 4.30). usage: tests/check_glsl.sh NAME
lib=$1
. "$(dirname "$0")/check.sh"
have glslangValidator || { skip "no glslangValidator (glslang-tools)"; finish; }
dir=build/check/glsl/$lib
rm -rf "$dir"; mkdir -p "$dir/text"
ok "compiles" ${CC:-cc} -std=c99 -O1 -w -I. -Itests -D${lib^^}_GL -D_POSIX_C_SOURCE=200809L tests/glsl_dump.c -o "$dir/dump" -lm -lpthread
[ "$failed" = 0 ] || finish
ok "writes its shaders" "$dir/dump" "$dir/text"
# a file a line without a complaint; with one, the file's name and what is wrong
log=$(cd "$dir/text" && ls | xargs -n 200 glslangValidator 2>&1)
bad=$(echo "$log" | awk '/^[0-9]+\.(vert|frag|comp)$/ { name = $1 } /ERROR|WARNING/ && !(name in seen) { seen[name] = 1; print name ": " $0 }' | head -20)
count=$(ls "$dir/text" | wc -l)
if [ -n "$bad" ]; then fail "shaders of $dir/text that glslangValidator refuses" "$bad"; else passed=$((passed + count)); fi
finish
