#!/bin/sh
# Puts the programs of tests/test_readme.h into README.md, after each line "<!-- NAME -->"; prints the result.
# usage: tests/readme.sh >README.new
awk '
    FNR == NR {
        if ($0 ~ /\/\* README end \*\//) name = ""
        else if ($0 ~ /\/\* README: /) { name = $0; sub(/.*README: /, "", name); sub(/ .*/, "", name); indent = match($0, /[^ ]/) - 1 }
        else if (name != "") code[name] = code[name] substr($0, indent + 1) "\n"
        next
    }
    /^<!-- .* -->$/ && ($2 in code) { print; printf "```c\n%s```\n", code[$2]; skip = 1; next }
    skip == 1 { skip = $0 == "```c" ? 2 : 0; if (skip) next }
    skip == 2 { if ($0 == "```") skip = 0; next }
    { print }
' tests/test_readme.h README.md
