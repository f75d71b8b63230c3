# Writes the one-file edition of a header: the header with what it needs of sat.h inside, private (static).
#
#     awk -f tests/make_dist.awk sat.h tonemap.h >dist/tonemap.h
#
# sat.h is cut at its marks "dist: PART" into its interface, the parts for the sibling headers, with and without OpenGL, and the
# implementation; a part that the header does not use stays out. Of the interface the types are
# kept, and the few functions that callers of any header need; all other functions of sat.h appear only where the header
# is implemented, so that a file which merely includes an edition gets nothing but declarations. All editions carry the
# same text under the same guards: several may meet in one file, and in several files of one program.

BEGIN { helpers = "^(sat_version|sat_result_text|sat_image_f32)$"; part = "nothing" }

function add(name, text) { text_of[name, ++size[name]] = text }

# ---- sat.h, cut into parts ----

FNR == NR {
    if (/^\/\* dist: [a-z_]+ \*\/$/) { part = $3; next }
    line = $0
    gsub(/defined\(SAT_IMPLEMENTATION\)/, "1", line)
    add(part, line)
    next
}

# ---- the header ----

FNR == 1 { lib = FILENAME; sub(/.*\//, "", lib) }
{
    add("header", $0)
    if (/SAT_SIBLING_GL/) uses_gl = 1
    line = $0
    while (match(line, /[A-Za-z0-9_]+ *\(/)) {
        name = substr(line, RSTART, RLENGTH)
        sub(/ *\($/, "", name)
        if (name ~ /^sat_[a-z0-9]/ && name !~ helpers) uses_core = 1
        line = substr(line, RSTART + RLENGTH)
    }
}

function paste(name,    i) { for (i = 1; i <= size[name]; ++i) print text_of[name, i] }

# The interface without functions and the comments before them; what is left out goes to the parts
# "prototypes" and "gl_prototypes".
function paste_interface(    i, line, comment, in_comment, in_prototype, mark, depth, gl) {
    for (i = 1; i <= size["interface"]; ++i) {
        line = text_of["interface", i]
        if (line ~ /^SAT_DEF /) { in_prototype = 1; comment = "" }
        if (in_prototype) { add(gl[depth] ? "gl_prototypes" : "prototypes", line); in_prototype = line !~ /;/; continue }
        if (line ~ /^\/\*/ || in_comment) {
            comment = comment line "\n"
            in_comment = line !~ /\*\//
            continue
        }
        if (line ~ /^#(if|ifdef|ifndef) /) gl[++depth] = gl[depth - 1] || line ~ /defined\(SAT_GL\)|ifdef SAT_GL$/
        if (line ~ /^#endif/) --depth
        printf "%s", comment
        comment = ""
        print line
        if (line ~ /^extern const int sat__define/) mark = 1
        if (mark && line ~ /^#endif/) { mark = 0; print ""; paste("helpers") }
    }
    printf "%s", comment
}

function paste_core(    i, line) {
    for (i = 1; i <= size["core"]; ++i) {
        line = text_of["core", i]
        if (line ~ /^static [^=]*\(/ && line !~ /^static inline/) sub(/^static /, "static inline ", line)   # may be unused
        print line
        if (line ~ /^#define SAT_(IMPLEMENTED|_GL_IMPLEMENTED)$/) {
            print "\n#ifdef __cplusplus\nextern \"C\" {\n#endif"
            paste(line ~ /GL/ ? "gl_prototypes" : "prototypes")
            print "#ifdef __cplusplus\n}\n#endif"
        }
    }
}

END {
    print "/* One-file edition of " lib ": sat.h is inside, private. Made by `make dist`; do not edit. */\n"
    for (k = 1; k <= size["header"]; ++k) {
        if (text_of["header", k] != "#include \"sat.h\"") { print text_of["header", k]; continue }
        if (++inclusions > 2) continue
        print "/* ================ from sat.h ================ */"
        if (inclusions == 1) {
            print "#if defined(SAT_H) && !defined(SAT_EDITION)"
            print "#error \"a one-file edition brings its own sat.h: include editions only, or plain headers only\""
            print "#endif\n#ifndef SAT_EDITION\n#define SAT_EDITION\n#define SAT_STATIC\n#endif"
            paste_interface()
        } else {
            paste("shared")
            if (uses_gl) paste("shared_gl")
            if (uses_core) paste_core()
        }
        print "/* ================ " lib " ================ */"
    }
}
