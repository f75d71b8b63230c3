#!/bin/bash
# One self-contained HTML page from benchmark tables; tests/bench/bench.h states their form. Plots by gnuplot, inside.
# usage: [PLOTS=docs] tests/report.sh TABLE.tsv... >index.html; PLOTS: plots that have a name (picture=name) go there too
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
plotting=1
command -v gnuplot >/dev/null || { plotting=; echo "no plots: apt-get install gnuplot-nox" >&2; }

escape() { sed 's/&/\&amp;/g; s/</\&lt;/g; s/>/\&gt;/g'; }

# split FILE: $work/N.rows (columns, then rows), N.title, N.plots, N.notes; prints how many
split() {
    rm -f "$work"/*.rows "$work"/*.title "$work"/*.plots "$work"/*.notes
    awk -v dir="$work" '
        function name(kind) { return dir "/" n "." kind }
        /^# table:/ { ++n; open = 1; print substr($0, 10) > name("title"); next }
        /^# plot:/ && n { print substr($0, 9) > name("plots"); next }
        /^# note:/ && n { print substr($0, 9) > name("notes"); next }
        /^# missing:/ && n { print substr($0, 12) > name("notes"); next }
        /^#/ { next }
        /^[ \t]*$/ { next }
        open { print > name("rows") }
        END { print n + 0 }' "$1"
}

# value KEY PLOT: what the line "title; key=value; key=value" says
value() { tr ';' '\n' <<<"$2" | sed -n "s/^ *$1=//p" | head -1 | sed 's/ *$//'; }

# plot ROWS LINE: an SVG on stdout; nothing when a column is missing or no row has numbers. One colour and mark for each value of
# the column `by`, a red ring around the default.
plot() {
    local rows=$1 x y log style title
    title=${2%%;*} x=$(value x "$2") y=$(value y "$2") log=$(value log "$2") style=$(value style "$2")
    awk -F '\t' -v x="$x" -v y="$y" -v by="$(value by "$2")" -v where="$(value where "$2")" -v style="${style:-points}" -v log_axes="$log" '
        function number(v) { return v ~ /^ *[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)? *$/ }
        # room around the points; on a logarithmic axis of less than two decades more than the powers of ten get marks
        function range(axis, low, high,    room, power, i, k, mark, marks) {
            if (log_axes ~ axis) {
                room = (high / low) ^ 0.06; if (room < 1.15) room = 1.15
                low /= room; high *= room
                k = split(high / low < 5 ? "1 1.5 2 3 4 5 6 8" : "1 2 5", mark, " ")
                if (high / low < 100) {
                    for (power = 10 ^ int(log(low) / log(10) - 2); power < high; power *= 10)
                        for (i = 1; i <= k; ++i) if (mark[i] * power > low && mark[i] * power < high) marks = marks (marks == "" ? "" : ", ") mark[i] * power
                    printf "set %stics (%s)\n", axis, marks
                }
            } else {
                room = high > low ? 0.05 * (high - low) : 0.5 + 0.05 * high
                low = low >= 0 && low < room ? 0 : low - room; high += room
            }
            printf "set %srange [%g:%g]\n", axis, low, high
        }
        function quoted(text) { gsub(/["\\]/, "", text); return "\"" text "\"" }
        BEGIN { split("#0072b2 #d55e00 #009e73 #cc79a7 #56b4e9 #e69f00 #000000 #7f3fbf", colour, " "); terms = split(where, term, ",") }
        NR == 1 { for (i = 1; i <= NF; ++i) column[$i] = i; next }
        !(x in column) || !(y in column) { exit }
        {
            for (i = 1; i <= terms; ++i) { split(term[i], pair, ":"); if ($column[pair[1]] != pair[2]) next }
            if (!number($column[x]) || !number($column[y])) next
            if ((log_axes ~ /x/ && $column[x] <= 0) || (log_axes ~ /y/ && $column[y] <= 0)) next
            u = $column[x] + 0; v = $column[y] + 0
            if (n == 0) { left = right = u; bottom = top = v }
            if (u < left) left = u; if (u > right) right = u; if (v < bottom) bottom = v; if (v > top) top = v
            key = by in column ? $column[by] : ""
            if (!(key in points)) names[n++] = key
            points[key] = points[key] $column[x] " " $column[y] "\n"
            if ("default" in column && $column["default"] == 1) ring = ring $column[x] " " $column[y] "\n"
        }
        END {
            if (n == 0) exit
            range("x", left, right); range("y", bottom, top)
            for (i = 0; i < n; ++i) printf "$series%d << end\n%send\n", i, points[names[i]]
            if (ring != "") printf "$default << end\n%send\n", ring
            printf "plot "
            for (i = 0; i < n; ++i) {
                printf "%s$series%d using 1:2 with %s linewidth 1.5 linecolor rgb \"%s\"", i ? ", " : "", i, style, colour[i % 8 + 1]
                if (style != "lines") printf " pointtype %d pointsize %s", i < 8 ? 7 : 9, i < 8 ? 0.8 : 1
                if (names[i] == "") printf " notitle"; else printf " title %s", quoted(names[i])
            }
            if (ring != "") printf ", $default using 1:2 with points pointtype 6 pointsize 1.6 linewidth 2 linecolor rgb \"#c03030\" title \"default\""
            print ""
        }' "$rows" >"$work/plot"
    [ -s "$work/plot" ] || return
    {
        echo "set terminal svg size 620,400 dynamic font 'sans-serif,12' background rgb 'white' name '$plot_id'"
        echo "set title '${title//\'/}' noenhanced; set xlabel '$x' noenhanced; set ylabel '$y' noenhanced"
        echo "set key outside right top maxcols 1 noenhanced reverse Left samplen 1.2 spacing 0.9 font ',10'; set grid linecolor rgb '#dddddd'"
        echo "set format '%g'"
        [ -z "$log" ] || echo "set logscale $log"
        cat "$work/plot"
    } | gnuplot 2>"$work/errors" | sed -e '/<?xml/d' -e '/<!DOCTYPE/,/>/d'
    ! [ -s "$work/errors" ] || { echo "$plot_id:"; cat "$work/errors"; } >&2
}

# the rows as an HTML table; the default's in bold
table() {
    escape <"$1" | awk -F '\t' '
        NR == 1 { printf "<div class=wide><table><tr>"; for (i = 1; i <= NF; ++i) { if ($i == "default") d = i; else printf "<th>%s", $i }; print "</tr>"; next }
        { printf "<tr%s>", d && $d == 1 ? " class=default" : ""; for (i = 1; i <= NF; ++i) if (i != d) printf "<td>%s", $i; print "</tr>" }
        END { print "</table></div>" }'
}

cat <<'HTML'
<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">
<title>lightscan: error against run time</title>
<style>
body { font: 15px/1.45 sans-serif; max-width: 1320px; margin: 2em auto; padding: 0 1em; color: #222; background: #fff }
h1, h2, h3 { font-weight: 600; margin: 1.6em 0 .4em } nav a { margin-right: 1em }
table { border-collapse: collapse; font-size: 13px; margin: .5em 0 } .wide { overflow-x: auto }
th, td { padding: .15em .6em; border-bottom: 1px solid #ddd; text-align: right; white-space: nowrap }
th:first-child, td:first-child { text-align: left } tr.default td { font-weight: 700; color: #c03030 }
.plots { display: flex; flex-wrap: wrap; gap: 12px } .plots svg { width: 620px; height: auto; border: 1px solid #eee }
.note, .machine { color: #666 } details { margin: .4em 0 }
</style></head><body>
<h1>lightscan: error against run time</h1>
<p>Each point and row is one configuration; red is the default. Times are ratios to a reference measured in the same run
wherever a column says so; other times hold for this machine only.</p>
HTML
echo "<nav>"
for file; do [ -s "$file" ] && printf '<a href="#%s">%s</a>\n' "$(basename "$file" .tsv)" "$(basename "$file" .tsv)"; done
echo "</nav>"
for file; do
    [ -s "$file" ] || continue
    id=$(basename "$file" .tsv)
    printf '<h2 id="%s">%s</h2>\n' "$id" "$id"
    sed -n 's/^# machine: */<p class=machine>/p' "$file" | head -1
    n=$(split "$file")
    for ((t = 1; t <= n; ++t)); do
        printf '<h3>%s</h3>\n' "$(escape <"$work/$t.title")"
        [ -s "$work/$t.rows" ] || { echo "<p class=note>No rows: an input or a package is absent.</p>"; continue; }
        if [ -n "$plotting" ] && [ -f "$work/$t.plots" ]; then
            echo "<div class=plots>"
            p=0
            while IFS= read -r line; do
                plot_id=${id}_${t}_$((++p))
                plot "$work/$t.rows" "$line" | tee "$work/svg"
                name=$(value picture "$line")
                [ -z "$PLOTS" ] || [ -z "$name" ] || ! [ -s "$work/svg" ] || cp "$work/svg" "$PLOTS/$name.svg"
            done <"$work/$t.plots"
            echo "</div>"
        fi
        [ ! -f "$work/$t.notes" ] || escape <"$work/$t.notes" | sed 's/^/<p class=note>/'
        rows=$(wc -l <"$work/$t.rows")
        echo "<details$([ "$rows" -gt 25 ] || echo " open")><summary>$((rows - 1)) rows</summary>"
        table "$work/$t.rows"
        echo "</details>"
    done
done
echo "</body></html>"
