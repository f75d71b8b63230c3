#!/bin/bash
# The report with every bench at its smallest sizes (SMOKE=1). usage: tests/check_report.sh all|none|broken
# all: with every optional package that is here; none: as if there were none; broken: no bench builds.
lib=$1
. "$(dirname "$0")/check.sh"
dir=build/report_$lib out=$dir/bench
rm -rf "$out" "$dir/report"; mkdir -p "$dir"
report() { make OPT=-O1 --no-print-directory report NO_DEPS=1 SMOKE=1 B="$dir" OUT="$out" REPORT="$dir/report" "$@" 2>&1; }

# Titles of the tables in the source of a bench; those that only a long run makes are named here.
long="8192 x 65536"
titles() { sed -n 's/.*bench_table("\([^"%]*\)".*/\1/p' "$1" | grep -vF "$long"; }

case $lib in
    broken)
        if text=$(report CC=false CXX=false LIB=fiv); then fail "a report without its bench ends with 0" "$text"
        elif grep -q 'failed: fiv' <<<"$text"; then pass
        else fail "the failure is not named" "$text"; fi
        [ ! -e "$out/fiv.tsv" ] && pass || fail "there is a table of a bench that was not built"
        ;;
    *)
        [ $lib = all ] && packages= || packages=1
        start=$(date +%s)
        ok "make report" report NO_PACKAGES=$packages
        echo "$(($(date +%s) - start)) s, compiling included"
        for source in tests/bench/bench_*.c*; do
            bench=$(basename "$source"); bench=${bench#bench_}; bench=${bench%.*}
            if [ -s "$out/$bench.tsv" ]; then pass; else fail "no tables of $bench"; continue; fi
            while IFS= read -r title; do
                # a title, its plots and notes, then at least a line of column names and a row
                rows=$(awk -v title="# table: $title" '$0 == title { open = 1; next } /^# table/ { open = 0 }
                    open && /^# missing/ { lost = 1 } open && /./ && !/^#/ { ++n } END { if (n > 1) print n; else print lost ? "lost" : 0 }' "$out/$bench.tsv")
                [ "$title" = "Fit of the comparators" ] || case $rows in
                    0) fail "$bench: the table is empty: $title" ;;
                    lost) [ $lib = none ] && pass || fail "$bench: nothing but a missing package: $title" ;;
                    *) pass ;;
                esac
            done < <(titles "$source")
        done
        html=$dir/report/index.html
        for bench in sat tonemap ssao_sat fiv raindrop softassign; do   # the answers are there
            if grep -q "<h3><a href=\"#$bench\">" "$html" && ! grep -A1 "<h3><a href=\"#$bench\">" "$html" | grep -q 'Not measured'; then pass
            else fail "the page has no answer for $bench: its table has no default row, or another title"; fi
        done
        for bench in sat tonemap ssao_sat fiv raindrop softassign; do   # and a line of each in the summary
            if grep -q "^<tr><td><a href=\"#answer-$bench\">" "$html"; then pass; else fail "the summary has no line of $bench"; fi
        done
        for bench in sat tonemap ssao_sat raindrop; do   # pictures of where they err, inside the page; those of fiv need data
            if [ -s "$out/pictures/${bench}_truth.png" ] && [ -s "$out/pictures/${bench}_default.png" ] &&
               grep -A1 "^<h3>$bench.h: " "$html" | grep -q 'src="data:image/png;base64,iVBOR'; then pass
            else fail "the page has no pictures of $bench"; fi
        done
        empty "what the page asks of a network" "$(grep -oE '(src|href)="(https?:)?//[^"]*' "$html")"
        if grep -q '<title>[^<]*time[^<]* [0-9]' "$html" || ! command -v gnuplot >/dev/null; then pass; else fail "no point of a plot tells its values"; fi
        if [ -s "$html" ] && grep -q '</html>' "$html"; then pass; else fail "the page is not whole"; fi
        if [ $lib = none ]; then
            for peer in OpenCV Embree; do
                if grep -q "$peer is not installed" "$html"; then pass; else fail "the page does not say that $peer is missing"; fi
            done
        fi
        ;;
esac
finish
