#!/bin/bash
# One self-contained HTML page from benchmark tables; tests/bench/bench.h states their form. Plots by gnuplot, inside.
# First the answers, a line and then a table and a plot for each technique; then where the errors are, error against run time, extreme
# cases, what is left out; all tables at the end.
# usage: [PLOTS=docs] tests/report.sh TABLE.tsv... >index.html; PLOTS: plots that have a name (picture=name) go there too,
# and the summary goes beside the tables, as answers.tsv
work=$(mktemp -d) || exit 1
trap 'rm -rf "$work"' EXIT
plotting=1
command -v gnuplot >/dev/null || { plotting=; echo "no plots: apt-get install gnuplot-nox" >&2; }

escape() { sed 's/&/\&amp;/g; s/</\&lt;/g; s/>/\&gt;/g'; }

# split FILE: $work/ID/N.rows (columns, then rows), N.title, N.plots, N.notes; prints how many
split() {
    local dir; dir=$work/$(basename "$1" .tsv); mkdir -p "$dir"
    awk -v dir="$dir" '
        function name(kind) { return dir "/" n "." kind }
        /^# table:/ { ++n; open = 1; print substr($0, 10) > name("title"); next }
        /^# picture:/ && n { print substr($0, 12) > (dir "/pictures"); next }
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

# words COLUMN: the name of a column as a reader says it, with its unit
words() {
    sed -E 's/^time_ratio$/time ('"${reference:-times the reference}"')/; s/^rms_codes$/error (8-bit codes, root mean square)/; s/^(n?rmse)$/error (root mean square)/
        s/^rmse_other_scene$/error on a scene held out (root mean square)/; s/^time_memcpy_ratio$/time (times that of a copy)/; s/^point_us$/time of a point (µs)/
        s/^(median|p99)_relative$/relative error of a box (\1)/; s/^excess$/cost above the optimum (share)/; s/^certified_gap$/proven gap (share)/
        s/_ms$/ (ms)/; s/_us$/ (µs)/; s/_mb$/ (MB)/; s/_s$/ (s)/; s/_percent$/ (percent)/; s/_ratio$/ (ratio)/; s/_codes$/ (8-bit codes)/; s/_/ /g' <<<"$1"
}
# good COLUMN COLUMN: which way is better, in a plot with these axes
good() {
    local x='(time|_ms|_us|memcpy)' y='(err|rms|relative|excess|gap|_ms|accesses|mismatch|codes)'
    if [[ $1 =~ $x && $2 =~ $y ]]; then echo 'down and left is better'; elif [[ $2 =~ fps ]]; then echo 'up is better'; elif [[ $2 =~ $y || $2 =~ $x ]]; then echo 'down is better'; fi
}

# plot ROWS LINE: an SVG on stdout; nothing when a column is missing or no row has numbers. One colour and mark for each value of
# the column `by`, or of its first words where there are many; a red ring around the default. titled=1: the title stands inside.
plot() {
    local rows=$1 x y log style title families
    title=${2%%;*} x=$(value x "$2") y=$(value y "$2") log=$(value log "$2") style=$(value style "$2")
    [ "$(awk -F '\t' -v by="$(value by "$2")" 'NR == 1 { for (i = 1; i <= NF; ++i) if ($i == by) c = i } NR > 1 && c && !seen[$c]++ { ++n } END { print n + 0 }' "$1")" -le 14 ] || families=1
    awk -F '\t' -v x="$x" -v y="$y" -v xw="$(words "$x")" -v yw="$(words "$y")" -v by="$(value by "$2")" -v where="$(value where "$2")" -v style="${style:-points}" -v log_axes="$log" -v id="$plot_id" -v families="$families" -v titled="$titled" '
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
            full = key = by in column ? $column[by] : ""
            if (families) sub(/[ ,].*/, "", key)
            if (!(key in points)) names[n++] = key
            points[key] = points[key] $column[x] " " $column[y] " \"" (full == "" ? "" : full ": ") xw " " $column[x] ", " yw " " $column[y] "\"\n"
            if ("default" in column && $column["default"] == 1) ring = ring $column[x] " " $column[y] "\n"
        }
        END {
            if (n == 0) exit
            # names below, in as many columns as they leave room for
            for (i = 0; i < n; ++i) if (length(names[i]) > longest) longest = length(names[i])
            columns = longest < 14 ? 3 : longest < 27 ? 2 : 1; lines = int((n + (ring != "") + columns - 1) / columns)
            printf "set terminal svg size 520,%d dynamic font \"sans-serif,14\" background rgb \"white\" name \"%s\"\n", (titled ? 375 : 335) + 18 * lines, id
            printf "set key outside center bottom horizontal maxcols %d noenhanced reverse Left samplen 1 spacing 1 font \",13\"\n", columns
            range("x", left, right); range("y", bottom, top)
            for (i = 0; i < n; ++i) printf "$series%d << end\n%send\n", i, points[names[i]]
            if (ring != "") printf "$default << end\n%send\n", ring
            printf "plot "
            for (i = 0; i < n; ++i) {
                printf "%s$series%d using 1:2 with %s linewidth 1.5 linecolor rgb \"%s\"", i ? ", " : "", i, style, colour[i % 8 + 1]
                if (style != "lines") printf " pointtype %d pointsize %s", i < 8 ? 7 : 9, i < 8 ? 0.8 : 1
                if (names[i] == "") printf " notitle"; else printf " title %s", quoted(names[i])
            }
            for (i = 0; i < n; ++i) printf ", $series%d using 1:2:3 with labels hypertext point pointtype 7 pointsize 0.8 linecolor rgb \"%s\" notitle", i, colour[i % 8 + 1]
            if (ring != "") printf ", $default using 1:2 with points pointtype 6 pointsize 1.6 linewidth 2 linecolor rgb \"#c03030\" title \"default\""
            print ""
        }' "$rows" >"$work/plot"
    [ -s "$work/plot" ] || return
    {
        [ -z "$titled" ] || echo "set title \"${title//[\"\\]/}\\n$(good "$x" "$y")\" noenhanced font ',13'"
        echo "set xlabel \"$(words "$x")\n\" offset 0,0.5 noenhanced; set ylabel '$(words "$y")' noenhanced; set grid linecolor rgb '#dddddd'; set format '%g'"
        [ -z "$log" ] || echo "set logscale $log"
        cat "$work/plot"
    } | gnuplot 2>"$work/errors" | sed -e '/<?xml/d' -e '/<!DOCTYPE/,/>/d' \
        -e "s|<g onmousemove=\"gnuplot_svg.showHypertext(evt,'\(.*\)')\"[^>]*><title> </title>|<g><title>\1</title>|" \
        -e 's|<title>[^<]*_plot_[0-9]*</title>||' -e 's|<title>\$[^<]*</title>||'
    ! [ -s "$work/errors" ] || { echo "$plot_id:"; cat "$work/errors"; } >&2
}

# figure ROWS LINE: the plot with its title and which way is better as a caption, which wraps
figure() {
    plot "$1" "$2" >"$work/svg"
    [ -s "$work/svg" ] || return
    printf '<figure><figcaption>%s <span>%s</span></figcaption>\n' "$(escape <<<"${2%%;*}")" "$(good "$(value x "$2")" "$(value y "$2")")"
    cat "$work/svg"
    echo '</figure>'
}

# pictures ID FOLDER: the pictures of a header in a row, inside the page
pictures() {
    local file caption scale low high
    while IFS=';' read -r file caption scale low high; do
        file=$2/pictures/${file// /}
        [ -s "$file" ] || continue
        printf '<figure><img alt="%s" src="data:image/png;base64,%s">' "$(escape <<<"${caption# }")" "$(base64 <"$file" | tr -d '\n')"
        printf '<figcaption>%s<br>%s <i class=%s></i> %s</figcaption></figure>\n' "$(escape <<<"${caption# }")" "${low# }" "${scale# }" "${high# }"
    done <"$work/$1/pictures"
}

# the rows as an HTML table; the default's in bold; a column of nothing but "-" belongs to a peer that is not here
table() {
    escape <"$1" | awk -F '\t' '
        NR == 1 { for (i = 1; i <= NF; ++i) { name[i] = $i; if ($i == "default") d = i }; columns = NF; next }
        { for (i = 1; i <= columns; ++i) { cell[NR, i] = $i; if ($i != "-") filled[i] = 1 } }
        END {
            printf "<div class=wide><table><tr>"
            for (i = 1; i <= columns; ++i) if (i != d && (filled[i] || NR == 1)) printf "<th>%s", name[i]
            print "</tr>"
            for (r = 2; r <= NR; ++r) {
                printf "<tr%s>", d && cell[r, d] == 1 ? " class=default" : ""
                for (i = 1; i <= columns; ++i) if (i != d && filled[i]) printf "<td>%s", cell[r, i]
                print "</tr>"
            }
            print "</table></div>"
        }'
}

# rows ID TITLE: the file of the table whose title starts so
rows() { local f; for f in "$work/$1"/*.title; do [ -f "$f" ] && [[ $(<"$f") == "$2"* ]] && echo "${f%.title}.rows" && return; done; }
# pick ROWS WHERE COLUMN [least|last]: a cell of the first (or the least, or last) row with column:value;column:value, where ~ starts a
# pattern
pick() {
    [ -s "$1" ] || return
    awk -F '\t' -v where="$2" -v want="$3" -v how="$4" '
        BEGIN { terms = split(where, term, ";") }
        NR == 1 { for (i = 1; i <= NF; ++i) at[$i] = i; next }
        {
            for (t = 1; t <= terms; ++t) {
                if (term[t] == "") continue
                c = term[t]; sub(/:.*/, "", c); v = term[t]; sub(/^[^:]*:/, "", v)
                if (!(c in at)) next
                if (v ~ /^~/) { if ($at[c] !~ substr(v, 2)) next } else if ($at[c] != v) next
            }
            if (!(want in at) || $at[want] == "-" || $at[want] == "") next
            if (how == "least") { if (!n++ || $at[want] + 0 < best + 0) best = $at[want] } else { best = $at[want]; if (how != "last") exit }
        }
        END { if (best != "") print best }' "$1"
}

# compare A B WORD: "WORD 3 times smaller", "1.3 times the WORD", "3 times faster"
compare() {
    awk -v a="$1" -v b="$2" -v word="$3" 'BEGIN {
        if (a == "" || b == "" || b + 0 <= 0) exit
        r = a / b
        if (r < 0.5 && word == "time") printf "%.3g times faster", 1 / r
        else if (r < 1e-6) printf "%s %.2g million times smaller", word, 1e-6 / (r > 1e-30 ? r : 1e-30)
        else if (r < 1e-3) printf "%s %.2g thousand times smaller", word, 1e-3 / r
        else if (r < 0.5) printf "%s %.3g times smaller", word, 1 / r
        else if (r < 0.97) printf "%.0f %% of the %s", 100 * r, word
        else if (r < 1.03) printf "the same %s", word
        else printf "%.3g times the %s", r, word }'
}

# One of the answers: header, what it does, table, rows to look at, column of error, of time, row of the published method, rows of
# peers (their best is taken), a sentence more, what takes the time 1, the error that stands for none. A line goes into the summary.
answer() {
    local id=$1 what=$2 file where=$4 e=$5 t=$6 published=$7 peers=$8 de dt pe pt qe qt qname by text= line reference=${10:+1: ${10}} none=${11} p= q=
    file=$(rows "$id" "$3")
    by=${published%%:*}
    printf '<section class=answer id="answer-%s"><div><h3><a href="#%s">%s.h</a></h3><p>%s</p>' "$id" "$id" "$id" "$what"
    de=$(pick "$file" "$where;default:1" "$e") dt=$(pick "$file" "$where;default:1" "$t")
    if [ -z "$de" ]; then echo "<p class=note>Not measured in this run.</p></div></section>"; return; fi
    said() { if [ -n "$none" ] && awk -v v="$1" -v none="$none" 'BEGIN { exit v + 0 > none + 0 }'; then echo none; else echo "$1"; fi; }
    against() { if [ "$(said "$2")" = none ]; then echo "no error, either"; elif [ "$(said "$1")" = none ]; then echo "no error against $2"; else compare "$1" "$2" error; fi; }
    [ -z "$published" ] || { pe=$(pick "$file" "$where;$published" "$e") pt=$(pick "$file" "$where;$published" "$t"); }
    [ -z "$peers" ] || qe=$(pick "$file" "$where;$peers" "$e" least)
    [ -z "$qe" ] || { qt=$(pick "$file" "$where;$peers;$e:$qe" "$t"); qname=$(pick "$file" "$where;$peers;$e:$qe" "$by"); }
    echo "<table><tr><th><th>$(words "$e")<th>$(words "$t")</tr><tr class=default><td>default<td>$(said "$de")<td>$dt</tr>"
    [ -z "$pe" ] || echo "<tr><td>published method<td>$(said "$pe")<td>$pt</tr>"
    [ -z "$qe" ] || echo "<tr><td>best peer: $(escape <<<"$qname")<td>$(said "$qe")<td>$qt</tr>"
    echo "</table>"
    [ -z "$pe" ] || p="$(against "$de" "$pe"), $(compare "$dt" "$pt" time)" text="Against the published method: $p."
    [ -z "$qe" ] || q="$(against "$de" "$qe"), $(compare "$dt" "$qt" time)" text="$text Against the best peer: $q."
    printf '<tr><td><a href="#answer-%s">%s</a><td>%s<td>%s<td class=text>%s<td class=text>%s</tr>\n' "$id" "$id.h" \
        "$(said "$de") $(words "$e" | sed 's/^[^(]*//')" "$dt $(words "$t" | sed 's/^[^(]*//')" "${p:-&ndash;}" \
        "${q:-${9:-&ndash;}}${q:+ ($(escape <<<"$qname"))}" >>"$work/summary"
    printf '%s\t%s\t%s\t%s\n' "[\`$id.h\`]($id.h)" "$(short "$(said "$de")") $(words "$e" | sed 's/^[^(]*//')" "$(short "$dt") $(words "$t" | sed 's/^[^(]*//')" \
        "$(tr '\n' ' ' <<<"${p:+published method: $p. }${q:+$qname: $q. }$9" | sed 's/ *$//')" >>"$work/summary.tsv"
    printf '<p class=said>%s %s</p></div><div class=plots>' "$text" "$9"
    line=$(grep -h 'picture=' "${file%.rows}.plots" 2>/dev/null | head -1)
    plot_id=answer_$id
    [ -z "$line" ] || [ -z "$plotting" ] || figure "$file" "$line"
    echo "</div></section>"
}

short() { awk -v v="$1" 'BEGIN { if (v ~ /^[-+.0-9]/) printf "%.3g", v; else print v }'; }

# A case: header, what breaks, how the usual way does, how this does, the bound that must hold; judged here.
case_row() {
    local verdict
    [ -n "$4" ] || { printf '<tr><td>%s<td class=text>%s<td colspan=4>not measured in this run</tr>\n' "$1" "$2"; return; }
    verdict=$(awk -v v="$4" -v bound="$5" 'BEGIN { print v != "nan" && v != "-nan" && v + 0 <= bound ? "<td class=pass>holds" : "<td class=fail>FAILS" }')
    printf '<tr><td>%s<td class=text>%s<td>%s<td>%s<td>%s%s</tr>\n' "$1" "$2" "${3:-&ndash;}" "$4" "$5" "$verdict"
}
left_row() { [ -z "$3" ] || printf '<tr><td>%s<td class=text>%s<td>%s<td>%s<td>%s</tr>\n' "$1" "$2" "$3" "${4:-&ndash;}" "${5:-&ndash;}"; }
inverse() { [ -z "$1" ] || awk -v v="$1" 'BEGIN { if (v + 0 > 0) printf "%.3g", 1 / v }'; }
percent() { [ -z "$1" ] || awk -v v="$1" 'BEGIN { printf "%.3g %%", 100 * v }'; }

for file; do [ ! -s "$file" ] || split "$file" >/dev/null; done
first=
for file; do [ ! -s "$file" ] || { first=$file; break; }; done
folder_of_tables=$(dirname "$first")
missing=$(cat "$@" 2>/dev/null | sed -n 's/^# missing: \(.*\) is not installed (\([^)]*\)).*/\1 (\2)/p' | sort -u | paste -sd';')
present=
for peer in OpenCV:sat Embree:fiv pfstools:tonemap scipy:softassign; do
    [ ! -d "$work/${peer#*:}" ] || [[ $missing == *"${peer%:*}"* ]] || present="$present${present:+, }${peer%:*}"
done

cat <<'HTML'
<!DOCTYPE html>
<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width, initial-scale=1">
<title>lightscan: error against run time</title>
<style>
body { font: 15px/1.45 sans-serif; max-width: 1320px; margin: 1.5em auto; padding: 0 1em; color: #222; background: #fff }
h1, h2, h3 { font-weight: 600; margin: 1.4em 0 .4em } h1 { margin-top: 0 } nav a { margin-right: 1em } .answer h3 { margin: 0 }
table { border-collapse: collapse; font-size: 13px; margin: .5em 0 } .wide { overflow-x: auto }
th, td { padding: .15em .6em; border-bottom: 1px solid #ddd; text-align: right; white-space: nowrap; vertical-align: top }
th:first-child, td:first-child, th.text, td.text { text-align: left } td.text { white-space: normal; min-width: 14em }
.answer th, .answer td { white-space: normal; max-width: 14em }
tr.default td { font-weight: 700; color: #c03030 } td.pass { color: #087030 } td.fail { color: #fff; background: #c02020; font-weight: 700 }
.answer { display: grid; grid-template-columns: minmax(0, 1fr) minmax(0, 480px); gap: 0 20px; border-top: 1px solid #ccc; padding: 1em 0 }
.answer p { margin: .3em 0 } .said { font-weight: 600 }
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(min(100%, 480px), 1fr)); gap: 12px } .plots svg { width: 100%; height: auto; border: 1px solid #eee }
figure { margin: 0 } figcaption { font-size: 13px } .plots figcaption span { color: #087030; display: block }
.pictures { display: flex; flex-wrap: wrap; gap: 12px; margin: .4em 0 1.4em } .pictures figure { width: min(calc(50% - 6px), 240px) }
.pictures img { width: 100%; image-rendering: pixelated; border: 1px solid #ddd; display: block }
figcaption i { display: inline-block; width: 70px; height: 9px; border: 1px solid #bbb; print-color-adjust: exact; -webkit-print-color-adjust: exact }
.grey { background: linear-gradient(90deg, #000, #fff) } .heat { background: linear-gradient(90deg, #fff, #ffe678, #f0781e, #b4141e, #1e0014) }
.signed { background: linear-gradient(90deg, #142896, #6ea0e6, #fff, #f08c64, #960a1e) }
.note, .machine { color: #666 } details { margin: .4em 0 }
@media (max-width: 800px) {
    .answer { grid-template-columns: minmax(0, 1fr) }
    .summary td { min-width: 0 !important }
}
@media screen and (max-width: 800px) { .summary :is(th, td):is(:nth-child(2), :nth-child(3)) { display: none } }
@media print { .summary :is(th, td) { white-space: normal; min-width: 0 !important; text-align: left; font-size: 85% } nav { display: none } details:not([open]) { display: none } .answer, figure, tr { break-inside: avoid } h2, h3 { break-after: avoid } body { max-width: none } }
</style></head><body>
<h1>lightscan: error against run time</h1>
<nav><a href="#answers">Answers</a> <a href="#where">Where the errors are</a> <a href="#time">Error against run time</a> <a href="#cases">Stiff and extreme cases</a> <a href="#left">What is left out</a> <a href="#tables">All tables</a></nav>
HTML
printf '<p class=machine>%s. Compiled with %s. %s, commit %s. %s</p>\n' "$(sed -n 's/^# machine: *//p' "$first" /dev/null | head -1 | escape)" \
    "$(escape <<<"${REPORT_FLAGS:-unknown options}")" "$(date -u '+%Y-%m-%d %H:%M UTC')" "$(git rev-parse --short HEAD 2>/dev/null || echo unknown)" \
    "${present:+Peers in this run: $(escape <<<"$present"). }${missing:+Not installed, their rows and columns are left out: $(escape <<<"$missing").}"
[ -z "$REPORT_SHORT" ] || echo "<p class=fail>A short run ($REPORT_SHORT): fewer and smaller inputs, fewer repetitions. Run make report for figures to quote.</p>"

# the answers come into a file, for the lines of the summary stand before them
{
answer sat "Sums over any box of a picture in four reads; tiles keep them exact where a plain table drowns. Boxes of 3 x 3 in a picture of 14 decades; error: half of the boxes err by less, relative to their own mean." \
    "Precision" "picture:14 decades;box:3;side:$(pick "$(rows sat Precision)" "" side last)" median_relative time_memcpy_ratio "representation:float" "" \
    "$(v=$(pick "$(rows sat Build)" default:1 opencv_speedup); [ -z "$v" ] || echo "OpenCV's integral takes $v times the time of our build.")"
answer tonemap "HDR photographs to 8 bit, a local operator in constant time a pixel. Error: against Reinhard's local operator with exact Gaussians." \
    "Local operators" "picture:$(pick "$(rows tonemap "Local operators")" "" picture)" rms_codes time_ratio "operator:exact boxes" "operator:~^pfstmo" \
    "The default is meant to differ: beside an edge of 100:1 its halo is $(pick "$(rows tonemap Halos)" "contrast:100;default:1" dark_side_codes) codes, that of the published operator $(pick "$(rows tonemap Halos)" "contrast:100;operator:exact Gaussian" dark_side_codes)." \
    "local, soft scales"
answer ssao_sat "Ambient occlusion from a depth buffer. Error: against rays, three scenes, three radii." \
    "Error against time: 3" "" rmse time_ratio "method:refined, as printed" "method:~^(SSAO|HBAO|GTAO|XeGTAO|bitmask)" "" "minimalist"
answer fiv "Soft shadows of rigid things under a whole sky. Error: against rays to every texel of the light." \
    "A plane below" "environment:forest" nrmse point_us "accuracy:published" "" \
    "$(v=$(pick "$(rows fiv "A plane below")" "environment:forest;default:1" brute_ratio); [ -z "$v" ] || echo "Rays take $v times the time."
       f=$(rows fiv Suns) v=$(pick "$f" "environment:forest;gap_R:0.002" nrmse_views)
       [ -z "$v" ] || echo "On the floor it errs by $v, 128 rays a point by $(pick "$f" "environment:forest;gap_R:0.002" nrmse_128_rays), in $(pick "$f" "environment:forest;gap_R:0.002" views_over_rays | awk '{ printf "%.2g", $1 }') times their time.")"
answer raindrop "Rain of refracting drops. Error: against rays through every drop, 100000 drops." \
    "Rain: 100000" "" rmse time_ratio "method:map, unsorted (as published)" "" \
    "$(v=$(pick "$(rows raindrop "Rain: 100000")" default:1 reference_over_this_ratio); [ -z "$v" ] || echo "Rays take $v times the time.")" "sprites, sorted"
answer softassign "Photographs as mosaics of tiles: who goes where, at proven cost. Error: cost above the optimum, 100 cells of 100 tiles." \
    "Error against time, fig" "size:100x100" excess time_ms "method:published" "method:~^(LAPJV|annealing|ants)" "" "" 1e-7
} >"$work/answers"
echo '<h2 id=answers>What each default costs and errs</h2><p>Measured in this run, one thread. Red is the default; a ring marks it in the plots; a value shows where the pointer rests. Smaller is better, in the plots down and left.</p>'
[ -z "$PLOTS" ] || [ ! -s "$work/summary.tsv" ] || # for the README
    { printf 'header\terror of the default\ttime\tagainst the published method and the best peer measured\n'; cat "$work/summary.tsv"; } >"$folder_of_tables/answers.tsv"
if [ -s "$work/summary" ]; then
    echo '<div class=wide><table class=summary><tr><th>header<th>error<th>time<th class=text>the default against the published method<th class=text>against the best peer measured</tr>'
    cat "$work/summary"
    echo '</table></div>'
fi
cat "$work/answers"

if [ -n "$(find "$work" -name pictures -type f)" ]; then
    echo '<h2 id=where>Where the errors are</h2><p>White: none. Blue: too dark, red: too bright. The first of each row is the reference.</p>'
    where() { [ ! -s "$work/$1/pictures" ] || { echo "<h3>$1.h: $2</h3><div class=pictures>"; pictures "$1" "$folder"; echo '</div>'; }; }
    folder=$folder_of_tables
    where sat 'relative error of boxes of 3 x 3 in a picture of 14 decades, powers of ten'
    where tonemap 'local operators against the exact Gaussian one, 8-bit codes'
    where ssao_sat 'ambient occlusion of a room, radius 0.25, against rays'
    where fiv 'the floor below a rabbit, seen from above, in a forest; share of the brightest'
    where raindrop '100000 drops of 2 mm, tone-mapped luminance from 0 to 1'
fi

echo '<h2 id=time>Error against run time</h2><div class=plots>'
if [ -n "$plotting" ]; then
    for id in sat tonemap ssao_sat fiv raindrop softassign; do
        for f in "$work/$id"/*.plots; do
            [ -f "$f" ] || continue
            n=0
            while IFS= read -r line; do
                n=$((n + 1))
                [[ $(good "$(value x "$line")" "$(value y "$line")") == *left* ]] && [[ $line != *picture=* ]] || continue
                plot_id=time_${id}_$(basename "$f" .plots)_$n
                figure "${f%.plots}.rows" "$id.h: $line"
            done <"$f"
        done
    done
fi
echo '</div>'

echo '<h2 id=cases>Stiff and extreme cases</h2><p>Each judged from the numbers of this run.</p><div class=wide><table>'
echo '<tr><th>header<th class=text>what breaks, and the figure<th>the usual way<th>here<th>must be at most<th></tr>'
f=$(rows sat Precision)
case_row sat "Bright and dark pixels in one picture, 14 decades: a float table drowns the dark ones. Median relative error of 3 x 3 boxes" \
    "$(pick "$f" "picture:14 decades;box:3;representation:float" median_relative last)" "$(pick "$f" "picture:14 decades;box:3;default:1" median_relative last)" 1e-4
case_row sat "Sums of 3 x 3 boxes below zero, where all pixels are positive (share of boxes)" \
    "$(pick "$f" "picture:14 decades;box:3;representation:float" negative_share last)" "$(pick "$f" "picture:14 decades;box:3;default:1" negative_share last)" 0
f=$(rows tonemap "Ashikhmin's operator")
case_row tonemap "One firefly of a million times the largest luminance: root mean square change elsewhere, codes" "" "$(pick "$f" "" firefly_rms last)" 0.5
f=$(rows ssao_sat "The same against the range of depth")
case_row ssao_sat "A far background: error of a box mean of 1/z in depth steps (one tenth shows), the farthest three decades behind the nearest" \
    "$(pick "$f" "table:float;decades:3" largest_error)" "$(pick "$f" "table:~^uint32;decades:3" largest_error)" 0.1
f=$(rows fiv "Occluders cut")
case_row fiv "An occluder cut by the horizon: error of the light it takes, centre on the horizon" \
    "$(pick "$f" "height_radii:0.0" no_correction)" "$(pick "$f" "height_radii:0.0" cap)" 0.03
f=$(rows fiv "Two occluders")
case_row fiv "Two occluders that overlap: error of the irradiance" "$(pick "$f" "accuracy:nearest" nrmse)" "$(pick "$f" "accuracy:scaled" nrmse)" 0.05
f=$(rows raindrop Drag)
case_row raindrop "Stiff drag: a fog drop of 1 micrometre thrown at 10 m/s, one step of 1/60 s (5000 time constants): relative error of the velocity" \
    "$(pick "$f" "diameter_mm:0.001;step:Euler" error_relative)" "$(pick "$f" "diameter_mm:0.001;step:exact" error_relative)" 1e-5
f=$(rows softassign "Cold softassign")
case_row softassign "Annealing to a temperature of 1e-12, where the exponential overflows: cost above the optimum" "" "$(pick "$f" "temperature:1e-12" excess)" 0.05
f=$(rows softassign "Small matrices")
case_row softassign "Proof of optimality: largest gap the default leaves open (share of the cost)" "" "$(pick "$f" "default:1" certified_gap last)" 1e-9
echo '</table></div>'

echo '<h2 id=left>What is left out</h2><p>Work that the default, or one option, does not do: what it saves and what it costs.</p><div class=wide><table>'
echo '<tr><th>header<th class=text>what is left out<th>share left out<th>time saved or kept<th>error caused</tr>'
f=$(rows tonemap "Michael 2010, tables 11")
left_row tonemap "Searches away from edges (selective 0.1, photographic)" "$(percent "$(pick "$f" operator:photographic searched | awk '{ print 1 - $1 }')")" \
    "$(pick "$f" operator:photographic 'STM/LTM') times the frames" "SSIM $(pick "$f" operator:photographic ssim)"
f=$(rows ssao_sat "Leaving out regions")
left_row ssao_sat "Regions that are one plane (scene 0, radius 0.1)" "$(pick "$f" "scene:0;radius:0.1" flat_percent) %" \
    "$(pick "$f" "scene:0;radius:0.1" without_to_with_ratio) times as long without" "$(pick "$f" "scene:0;radius:0.1" largest_difference)"
f=$(rows fiv "Many occluders")
left_row fiv "Occluders too small to matter (the most occluders of the table)" "$(pick "$f" "" left_out_percent last) %" \
    "$(pick "$f" "" point_us last) µs a point, $(pick "$f" "" point_us_all_kept last) with all" ""
f=$(rows fiv Storage)
left_row fiv "Half of the bits of each vector and half of the sphere (half octahedral)" "$(percent "$(pick "$f" "storage:half octahedral" over_published_memory | awk '{ print 1 - $1 }')") of the published memory" \
    "$(pick "$f" "storage:half octahedral" point_us) µs a point, $(pick "$f" storage:float point_us) as float" "$(pick "$f" "storage:half octahedral" over_float_nrmse) times the error of float"
f=$(rows raindrop "Leaving out drops")
left_row raindrop "Drops that cover less than a thousandth of a pixel" "$(pick "$f" threshold_px:0.001 below) of $(pick "$f" threshold_px:0.001 drops) drops" \
    "$(pick "$f" threshold_px:0.001 time_ratio) times the time" "$(pick "$f" threshold_px:0.001 rmse) (root mean square)"
f=$(rows softassign "Features to proven")
left_row softassign "Distances never computed (exact), memory against the matrix" "$(percent "$(pick "$f" method:exact distances | awk '{ print 1 - $1 }')")" \
    "$(pick "$f" method:exact ratio_lapjv) times the time of LAPJV, $(percent "$(pick "$f" method:exact matrix_ratio)") of the memory" "$(pick "$f" method:exact excess), proven"
left_row softassign "The same with a gap that is allowed (fast)" "$(percent "$(pick "$f" method:fast distances | awk '{ print 1 - $1 }')")" \
    "$(pick "$f" method:fast ratio_lapjv) times the time of LAPJV" "$(pick "$f" method:fast excess) (proven: $(pick "$f" method:fast certified_gap))"
echo '</table></div>'

echo '<h2 id=tables>All tables</h2><p>Each row is one configuration, red the default. Tables of the theses and papers stand beside ours. Times are ratios to a reference of the same run wherever a column says so; other times hold for this machine only.</p><nav>'
for file; do [ -s "$file" ] && printf '<a href="#%s">%s</a>\n' "$(basename "$file" .tsv)" "$(basename "$file" .tsv)"; done
echo "</nav>"
for file; do
    [ -s "$file" ] || continue
    id=$(basename "$file" .tsv)
    printf '<h2 id="%s">%s</h2>\n' "$id" "$id"
    for ((t = 1; ; ++t)); do
        [ -f "$work/$id/$t.title" ] || break
        printf '<h3>%s</h3>\n' "$(escape <"$work/$id/$t.title")"
        [ ! -f "$work/$id/$t.notes" ] || escape <"$work/$id/$t.notes" | sed 's/^/<p class=note>/'
        [ -s "$work/$id/$t.rows" ] || { echo "<p class=note>No rows: an input or a package is absent.</p>"; continue; }
        if [ -n "$plotting" ] && [ -f "$work/$id/$t.plots" ]; then
            echo "<div class=plots>"
            p=0
            while IFS= read -r line; do
                plot_id=${id}_${t}_$((++p))
                figure "$work/$id/$t.rows" "$line"
                name=$(value picture "$line")
                [ -z "$PLOTS" ] || [ -z "$name" ] || ! [ -s "$work/svg" ] || titled=1 plot "$work/$id/$t.rows" "$line" >"$PLOTS/$name.svg"
            done <"$work/$id/$t.plots"
            echo "</div>"
        fi
        rows=$(wc -l <"$work/$id/$t.rows")
        echo "<details><summary>$((rows - 1)) rows</summary>"
        table "$work/$id/$t.rows"
        echo "</details>"
    done
done
echo "</body></html>"
