# The public prototypes of all headers as a table of calls for tests/null_arguments.c: each function with usable arguments, but
# one at a time NULL or zero, and with all of them so. Input: the preprocessed headers, one declaration a line.
function trim(s) { gsub(/^ +| +$/, "", s); return s }
function is_pointer(a) { return a ~ /[*]|\[/ }
# the type of a parameter without its name, const and array
function base(a) {
    gsub(/const |struct |\[[^]]*\]/, "", a)
    sub(/[a-zA-Z_0-9]+ *$/, "", a)
    gsub(/ +/, "", a)
    return a
}
function zero(a, t) {
    if (is_pointer(a)) return "NULL"
    t = base(a)
    return t ~ /^(int|float|double|size_t|unsigned|long|char|unsignedchar|unsignedint|int64_t|uint64_t|uint32_t|int32_t)$/ ? "0" : "zero_" (used[t] = t)
}
function usable(a, i, t) {
    t = base(a)
    if (t ~ /(_proc|_fn)\*$/) return "NULL"
    if (t ~ /\*\*$/) { sub(/\*\*$/, "", t); return t ~ /^(void|char|float|int)$/ ? "(" t " **)(void *)buffer[" i "]" : "(" t " **)(void *)buffer[" i "]" }
    if (is_pointer(a)) {
        sub(/\*$/, "", t)
        if (t in opaque) return "object_" t
        if (t in defaults) { structs[t] = 1; return "&some_" t }
        if (t == "sat_image") return "&some_image"
        if (t == "sat_const_image") return "&some_image"
        return "(" (t == "void" ? "void" : t == "unsignedchar" ? "unsigned char" : t) " *)(void *)buffer[" i "]"
    }
    if (zero(a) == "0") return t ~ /float|double/ ? "1" : "8"
    used[t] = t
    return "zero_" t
}
/typedef struct [a-z_0-9]+ [a-z_0-9]+ *;/ { match($0, /struct [a-z_0-9]+/); opaque[substr($0, RSTART + 7, RLENGTH - 7)] = 1; next }
/^ *extern / && /_defaults\(void\)/ { match($0, /extern +[a-z_0-9]+/); split(substr($0, RSTART, RLENGTH), w, / +/); f = $0; sub(/\(void\).*/, "", f); sub(/.* /, "", f); defaults[w[2]] = f }
/^ *extern .*\(.*\) *;/ { line[++lines] = $0 }
END {
    for (l = 1; l <= lines; ++l) {
        s = line[l]; sub(/ *; *$/, "", s)
        name = s; sub(/\(.*/, "", name); sub(/.*[ *]/, "", name)
        arguments = s; sub(/^[^(]*\(/, "", arguments); sub(/\)$/, "", arguments)
        if (name !~ /^(sat|tonemap|ssao_sat|fiv|raindrop|softassign)_[a-z]/ || name ~ /__/ || arguments ~ /[()]/) continue
        if (arguments == "void") continue
        n = split(arguments, arg, ",")
        for (k = 0; k <= n; ++k) {       # k = 0: all
            call = ""
            for (i = 1; i <= n; ++i) call = call (i > 1 ? ", " : "") (k == 0 || k == i ? zero(trim(arg[i])) : usable(trim(arg[i]), i - 1))
            rows[++count] = sprintf("static void call_%d(void) { %s(%s); }\n", count, name, call)
            what[count] = name "(" (k ? trim(arg[k]) " = 0" : "all 0") ")"
        }
    }
    for (t in used) printf "static %s zero_%s;\n", t, t
    for (t in structs) printf "static %s some_%s;\n", t, t
    print "static void fill_options(void)\n{"
    for (t in structs) printf "    some_%s = %s();\n", t, defaults[t]
    print "}"
    for (i = 1; i <= count; ++i) printf "%s", rows[i]
    print "static const struct { const char *what; void (*call)(void); } calls[] = {"
    for (i = 1; i <= count; ++i) printf "    {\"%s\", call_%d},\n", what[i], i
    print "};"
}
