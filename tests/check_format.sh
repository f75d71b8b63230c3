#!/bin/bash
# Layout: 120 columns, but for strings (shaders, messages), rows of option tables and preprocessor lines; no tabs,
# no blanks at the end of a line, one line feed at the end of a file. Within that, as the code around it.
lib=format
. "$(dirname "$0")/check.sh"

files=$(git ls-files '*.h' '*.c' '*.cpp' 2>/dev/null)
[ -n "$files" ] || files=$(ls ./*.h examples/*.[ch] tests/*.[ch] tests/*.cpp tests/bench/*.c tests/bench/*.cpp tests/bench/*.h)
for file in $files; do
    empty "$file" "$(awk 'length > 120 && !/"|SAT__FIELD/ && !/^#/ && !/\\$/ { print FNR ": " length " columns" }
        /\t/ { print FNR ": a tab" }
        / $/ { print FNR ": blanks at the end" }' "$file"; [ -z "$(tail -c 1 "$file")" ] || echo "no line feed at the end")"
done
finish
