#!/bin/sh
# Puts the programs of tests/test_readme.h into a page, after each line "<!-- NAME -->"; prints the result.
# usage: tests/readme.sh [PAGE.md [TABLES]]; TABLES: a folder of *.tsv; the first table of NAME.tsv goes after <!-- bench: NAME -->
page=${1:-README.md}
awk -v tables="$2" '
    function bench(file,    line, n, cells, i, row) {
        while ((getline line <file) > 0) {
            if (line ~ /^# table/ && n) break
            if (line ~ /^#/ || line == "") continue
            n = split(line, cells, "\t"); row = "|"
            for (i = 1; i <= n; i++) row = row " " cells[i] " |"
            print row
            if (!ruled++) { row = "|"; for (i = 1; i <= n; i++) row = row "---|"; print row }
        }
        close(file); ruled = 0
    }
    FNR == NR {
        if ($0 ~ /\/\* README end \*\//) name = ""
        else if ($0 ~ /\/\* README: /) { name = $0; sub(/.*README: /, "", name); sub(/ .*/, "", name); indent = match($0, /[^ ]/) - 1 }
        else if (name != "") code[name] = code[name] substr($0, indent + 1) "\n"
        next
    }
    /^<!-- .* -->$/ && ($2 in code) { print; printf "```c\n%s```\n", code[$2]; skip = 1; next }
    /^<!-- bench: .* -->$/ && tables != "" && (getline line <(tables "/" $3 ".tsv")) > 0 {
        close(tables "/" $3 ".tsv"); print; bench(tables "/" $3 ".tsv"); drop = 1; next
    }
    drop && /^\|/ { next }
    { drop = 0 }
    skip == 1 { skip = $0 == "```c" ? 2 : 0; if (skip) next }
    skip == 2 { if ($0 == "```") skip = 0; next }
    { print }
' tests/test_readme.h "$page"
