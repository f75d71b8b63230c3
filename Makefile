# lightscan: the headers need no build; this file builds examples, tests and reports. `make help` lists the targets.
# Everything is found by name: sat.h plugs in tests/test_sat.c, tests/use_sat.c, tests/bench/bench_sat.c, ...
# LIB=sat restricts a target to one header.

all: examples
.PHONY: all examples demo web check-view test bench report size check check-strict check-house check-variants check-asan check-tsan \
        check-analyze check-compilers check-report check-install check-doors check-glsl format-check fuzz data docs install dist gpu-bench deps help clean build-tests run-tests run-demo
.DELETE_ON_ERROR:
.SUFFIXES:
MAKEFLAGS += --no-builtin-rules

# ---- what there is ---------------------------------------------------------------------------------------------

FAMILY  := sat tonemap ssao_sat fiv raindrop softassign
LIB     ?=
PICK    := $(if $(LIB),$(LIB),$(FAMILY))
HEADERS := $(wildcard $(PICK:=.h))
LIBS    := $(HEADERS:.h=)

CC      := $(if $(filter default,$(origin CC)),$(firstword $(foreach c,cc gcc clang tcc,$(if $(shell command -v $c),$c))),$(CC))
CXX     := $(if $(filter default,$(origin CXX)),$(firstword $(foreach c,c++ g++ clang++,$(if $(shell command -v $c),$c))),$(CXX))
HAVE_CXX:= $(if $(CXX),$(shell command -v $(CXX)))

WERROR  ?= -Werror
WARN    := -Wall -Wextra -Wpedantic -Wconversion -Wsign-conversion -Wshadow -Wdouble-promotion -Wcast-qual -Wundef $(WERROR)
WARN_C  := $(WARN) -Wstrict-prototypes -Wmissing-prototypes
OPT     ?= -O2
STD      = $(if $(filter -std=%,$(CFLAGS)),,-std=c99)
CFLAGS  ?=
B       ?= build
DEFS    := -D_POSIX_C_SOURCE=200809L -I. -Itests -Iexamples
LDLIBS  := -lm -lpthread -ldl

# Optional packages: each gives flags where a program that includes its header compiles and links, asked when first needed.
# NO_PACKAGES=1 does as if there were none. H is a hash sign: make 4.2 and 4.3 read \# in a shell function differently.
H       := \#
PKG     := $(if $(NO_PACKAGES),,$(shell command -v pkg-config))
pkg      = $(if $(PKG),$(shell $(PKG) $(1) 2>/dev/null))
system   = $(patsubst -I%,-isystem %,$(filter-out -I/usr/include,$(filter -I%,$(call pkg,--cflags $(1)))))
# $(call links,NAME,COMPILER -x LANGUAGE,HEADER,FLAGS): 1 or nothing
links    = $(if $(NO_PACKAGES),,$(if $(filter undefined,$(origin FOUND_$(1))),$(eval FOUND_$(1) := $(shell \
           { [ -z '$(3)' ] || echo '$(H)include <$(3)>'; echo 'int main(void) { return 0; }'; } | \
           $(2) -w - -o /dev/null $(4) >/dev/null 2>&1 && echo 1)))$(FOUND_$(1)))

EXR_CORE = $(filter -lOpenEXRCore%,$(call pkg,--libs OpenEXR))
EXR_LIB  = $(if $(EXR),$(EXR_CORE))
EXR      = $(if $(call links,EXR,$(CC) -x c,openexr.h,$(call system,OpenEXR) $(EXR_CORE)),-DHAVE_OPENEXR $(call system,OpenEXR))
STB_LIB  = $(if $(STB),-lstb)
STB      = $(if $(call links,STB,$(CC) -x c,stb/stb_image.h,-lstb -lm),-DHAVE_STB)
OPENMP   = $(if $(call links,OPENMP,$(CC) -x c,,-fopenmp),-fopenmp)
GLFW     = $(call pkg,--cflags glfw3)
GLFW_LIB = $(if $(call links,GLFW,$(CC) -x c,GLFW/glfw3.h,$(call pkg,--cflags --libs glfw3)),$(call pkg,--libs glfw3))
OPENCV_LIB = $(if $(OPENCV),-lopencv_photo -lopencv_imgproc -lopencv_core)
OPENCV   = $(if $(if $(HAVE_CXX),$(call links,OPENCV,$(CXX) -x c++,opencv2/photo.hpp,$(call system,opencv4) -lopencv_photo \
           -lopencv_imgproc -lopencv_core)),-DHAVE_OPENCV $(call system,opencv4))
EMBREE_LIB = $(if $(EMBREE),-lembree3)
EMBREE   = $(if $(call links,EMBREE,$(CC) -x c,embree3/rtcore.h,-lembree3),-DHAVE_EMBREE)
PICTURES     = $(EXR) $(STB) $(OPENMP)
PICTURE_LIBS = $(EXR_LIB) $(STB_LIB)

# V=1 shows the commands. The old program goes first, lest it be taken for the result of a failed compilation.
SAY         = $(if $(V),,@echo '  $@';) rm -f $@; mkdir -p $(@D);
COMPILE_C   = $(SAY) $(CC) $(STD) $(OPT) $(WARN_C) $(DEFS) $(CFLAGS) -MMD -MP
COMPILE_CXX = $(SAY) $(CXX) -std=c++11 $(OPT) $(WARN) $(DEFS) $(CFLAGS) -MMD -MP

# Missing packages are installed by the first `make demo` or `make test` that may do so; NO_DEPS=1 says no.
deps: build/.deps
build/.deps:
	@mkdir -p build
	@NO_DEPS='$(NO_DEPS)' sh tests/deps.sh $(if $(PKG),,pkg-config) $(if $(EXR),,libopenexr-dev) \
	    $(if $(STB),,libstb-dev) libosmesa6
	@touch $@

# ---- examples --------------------------------------------------------------------------------------------------

EXAMPLE_SOURCES := $(filter-out %_view.c,$(wildcard examples/*.c))
VIEW_SOURCES    := $(if $(GLFW_LIB),$(wildcard examples/*_view.c))
EXAMPLES := $(EXAMPLE_SOURCES:examples/%.c=build/%) $(VIEW_SOURCES:examples/%.c=build/%)
examples: $(EXAMPLES)

build/gl_frame: examples/gl_frame.c
	$(COMPILE_C) $(PICTURES) $(if $(GLFW_LIB),-DHAVE_GLFW) $(GLFW) $< -o $@ $(PICTURE_LIBS) $(GLFW_LIB) $(LDLIBS)
build/%_view: examples/%_view.c
	$(COMPILE_C) $(PICTURES) $(GLFW) $< -o $@ $(PICTURE_LIBS) $(GLFW_LIB) $(LDLIBS)
build/%: examples/%.c
	$(COMPILE_C) $(PICTURES) $< -o $@ $(PICTURE_LIBS) $(LDLIBS)

# make demo [ARGS='--hour night ...'] renders the showcase, make demo IN=picture.exr tone-maps a picture
DEMO    := $(if $(IN),tonemap,demo)
demo: deps
	@$(MAKE) --no-print-directory run-demo
run-demo: build/$(DEMO)
	@mkdir -p out
	build/$(DEMO) --stats --out out/demo.png $(ARGS) $(IN)

# The demo in a browser: open out/web/index.html. emcc's optimiser is not run when linking: Debian's lacks a part.
# OpenEXR is fetched and compiled into build/web/; without it the page reads the other formats.
EMCC    ?= emcc
WEB_EXR := $(wildcard build/web/libexr.a)
WEB_STB := $(if $(wildcard /usr/include/stb/stb_image.h),build/web/stb.o)
WEB     := -I. -isystem build/web/include $(if $(WEB_STB),-DHAVE_STB) $(if $(WEB_EXR),-DHAVE_OPENEXR -isystem build/web/include/OpenEXR)
STB_IMPLEMENTATIONS := '\#define STB_IMAGE_IMPLEMENTATION\n\#define STB_IMAGE_WRITE_IMPLEMENTATION\n\#include <stb/stb_image.h>\n\#include <stb/stb_image_write.h>\n'
web:
	@if command -v $(EMCC) >/dev/null; then \
	     EMCC='$(EMCC)' NO_DEPS='$(NO_DEPS)' sh examples/web_exr.sh build/web && \
	     $(MAKE) --no-print-directory out/web/index.html; \
	 else echo 'make web needs emscripten: apt-get install emscripten'; fi
out/web/index.html: examples/demo_web.html out/web/demo_web.js
	cp $< $@
out/web/demo_web.js: build/web/demo_web.o $(WEB_STB) $(WEB_EXR)
	@mkdir -p $(@D)
	$(EMCC) -O1 $^ -o $@ -sALLOW_MEMORY_GROWTH=1 -sSINGLE_FILE=1 -sEXPORTED_RUNTIME_METHODS=ccall,FS -sFORCE_FILESYSTEM=1 -sENVIRONMENT=web \
	    -sMIN_WEBGL_VERSION=2 -sMAX_WEBGL_VERSION=2 -lGL -lhtml5
build/web/demo_web.o: examples/demo_web.c $(WEB_EXR) | build/web/include/stb
	$(EMCC) -std=gnu99 -O3 -msimd128 -msse2 $(WEB) -MMD -MP -c $< -o $@
build/web/stb.o: | build/web/include/stb
	printf $(STB_IMPLEMENTATIONS) | $(EMCC) -w -O3 $(WEB) -x c -c - -o $@
build/web/include/stb:
	@mkdir -p $(@D)
	ln -sfn /usr/include/stb $@

# ---- tests -----------------------------------------------------------------------------------------------------

TEST_SOURCES := $(if $(LIB),$(wildcard tests/test_$(LIB).c tests/test_$(LIB).cpp tests/test_$(LIB)_*.c tests/test_$(LIB)_*.cpp),\
                $(wildcard tests/test_*.c tests/test_*.cpp))
TESTS_C      := $(filter %.c,$(TEST_SOURCES))
TESTS_CXX    := $(if $(HAVE_CXX),$(filter %.cpp,$(TEST_SOURCES)))
TESTS        := $(TESTS_C:tests/%.c=$(B)/test/%_c) $(TESTS_CXX:tests/%.cpp=$(B)/test/%_cpp)

# The C++ twins all compile, and these run: the rest would run the same code again. TWINS='%' runs all.
TWINS        ?= support sat
RUN           = $(filter-out %_cpp,$(TESTS)) $(filter $(TWINS:%=$(B)/test/test_%_cpp),$(TESTS))

$(B)/test/%_c: tests/%.c
	$(COMPILE_C) $(PICTURES) $< -o $@ $(PICTURE_LIBS) $(LDLIBS)
$(B)/test/%_cpp: tests/%.cpp
	$(COMPILE_CXX) $(PICTURES) $< -o $@ $(PICTURE_LIBS) $(LDLIBS)

test: deps
	@$(MAKE) --no-print-directory run-tests
build-tests: $(TESTS)
	@:
run-tests:
	$(if $(HAVE_CXX),,@echo "no C++ compiler (g++): the C++ twins of the tests are left out")
	+@$(MAKE) --no-print-directory -k $(if $(filter -j%,$(MAKEFLAGS)),,-j2) build-tests || true
	@TEST_ARGS='$(ARGS)' BUILT='$(filter-out $(RUN),$(TESTS))' tests/run.sh $(RUN)

# ---- checks ----------------------------------------------------------------------------------------------------
# Each ends with the line "N passed, N failed, N skipped". TESTS_CXX= leaves the C++ twins out where they add nothing.

check: check-strict check-house check-glsl check-variants check-asan check-tsan check-analyze check-compilers

# warnings in all languages and compilers, linkage, names, macros, options, order of inclusion
check-strict:
	@RUNNER='bash tests/check_strict.sh' tests/run.sh $(LIBS) $(if $(LIB),,family dist examples)

# names that other headers take, stack, functions that nobody calls, comments against tables; NULL for every argument
check-house:
	@RUNNER='bash tests/check_house.sh' tests/run.sh $(LIBS) $(if $(LIB),,null)

# the same tests compiled otherwise; the three last are as games compile: the headers keep IEEE arithmetic by themselves
again = $(MAKE) --no-print-directory run-tests TESTS_CXX= B=build/$(1) OPT='$(or $(3),-O2)' CFLAGS='$(2)'
AVX2 := $(if $(shell grep -w -m1 avx2 /proc/cpuinfo 2>/dev/null),1)
check-variants:
	+@echo 'plain C instead of vector instructions:' && $(call again,no_simd,-DSAT_NO_SIMD)
	+@$(if $(AVX2),echo 'AVX2 and contraction:' && $(call again,avx2,-mavx2 -mfma -ffp-contract=fast))
	+@echo 'no contraction, no optimisation:' && $(call again,plain,-ffp-contract=off,-O0)
	+@echo '-ffast-math:' && $(call again,fast_math,-ffast-math)
	+@echo '-Ofast, GNU C, this processor:' && $(call again,ofast,-std=gnu11 -march=native,-Ofast)
	+@echo 'GNU C and its contraction, this processor:' && $(call again,gnu,-std=gnu11 -march=native)
	+@$(if $(shell command -v clang),echo 'clang:' && $(call again,clang,,-O3) CC=clang OPENMP= WERROR=)

ASAN  := -g -fno-omit-frame-pointer -fsanitize=address,undefined -fno-sanitize-recover=all
check-asan: export TEST_TIMEOUT = 1200
check-asan: export ASAN_OPTIONS = detect_stack_use_after_return=1:strict_string_checks=1
check-asan: export LSAN_OPTIONS = suppressions=tests/sanitizers.txt:print_suppressions=0
check-asan:
	+@$(call again,asan,$(ASAN),-O1)

# OpenMP's run-time and software GL are not instrumented: both are left out here
check-tsan: export TSAN_OPTIONS = second_deadlock_stack=1
check-tsan: export LIGHTSCAN_GL = none
check-tsan:
	+@$(call again,tsan,-g -fsanitize=thread,-O1) OPENMP=

check-analyze check-compilers: export TEST_TIMEOUT = 1800
check-analyze:
	@RUNNER='bash tests/check_analyze.sh' tests/run.sh $(LIBS)
check-compilers:
	@RUNNER='bash tests/check_compilers.sh' tests/run.sh $(LIBS)

# make fuzz [LIB=sat] [FUZZ_SECONDS=20]
fuzz:
	@RUNNER='bash tests/check_fuzz.sh' JOBS=1 tests/run.sh $(LIBS)

# the demo's window under Xvfb and its page in headless Chromium against the demo's picture
check-view: examples
	+@if command -v emcc >/dev/null; then $(MAKE) --no-print-directory web; fi
	@RUNNER='bash tests/check_view.sh' JOBS=1 tests/run.sh view web

# `make report` with all packages that are here and with none: whole, or a failure that is named
check-report:
	+@RUNNER='bash tests/check_report.sh' JOBS=1 TEST_TIMEOUT=600 tests/run.sh all none broken

# what `make install` writes and docs/packaging.md says, by pkg-config, CMake and Meson where they are
check-install:
	@RUNNER='bash tests/check_install.sh' JOBS=1 tests/run.sh install

# the steps of README.md and docs/, line by line, without packages
check-doors:
	@RUNNER='bash tests/check_doors.sh' TEST_TIMEOUT=600 tests/run.sh README photo mosaic engine

# every shader of every combination of options through glslangValidator
check-glsl:
	@RUNNER='bash tests/check_glsl.sh' tests/run.sh $(LIBS)

# columns, tabs and blanks of all sources
format-check:
	@RUNNER='bash tests/check_format.sh' JOBS=1 tests/run.sh format

# bytes of machine code with and without each option
size:
	@bash tests/size.sh $(LIBS)

# ---- benchmarks and reports ------------------------------------------------------------------------------------

BENCH_SOURCES := $(wildcard tests/bench/bench_*.c tests/bench/bench_*.cpp)
BENCH_NAMES   := $(sort $(patsubst tests/bench/bench_%.c,%,$(patsubst tests/bench/bench_%.cpp,%,$(BENCH_SOURCES))))
BENCHES       := $(foreach l,$(PICK) $(if $(LIB),,frame),$(filter $l $l_%,$(BENCH_NAMES)))
PEERS          = $(OPENCV) $(EMBREE)
LONGEST_FIRST  = $(filter frame,$(BENCHES)) $(filter-out frame,$(BENCHES))
OUT           ?= out/bench
REPORT        ?= report

$(B)/bench/bench_%_avx2: CFLAGS += $(if $(filter x86_64,$(shell uname -m)),-mavx2)
$(B)/bench/bench_%: tests/bench/bench_%.c
	$(COMPILE_C) -Itests/bench $(PICTURES) $(EMBREE) $< -o $@ $(PICTURE_LIBS) $(EMBREE_LIB) $(LDLIBS)
$(B)/bench/bench_%: tests/bench/bench_%.cpp
	$(COMPILE_CXX) -Itests/bench $(PICTURES) $(PEERS) $< -o $@ $(PICTURE_LIBS) $(OPENCV_LIB) $(EMBREE_LIB) $(LDLIBS)

# a table comes whole or not at all: what fails is named, and no table of another day stands in for it
RUN_BENCH = mkdir -p $(@D)/pictures && rm -f $@ && echo '  bench $(@F:.tsv=)' >&2 && \
    { QUICK='$(QUICK)' SMOKE='$(SMOKE)' NO_PACKAGES='$(NO_PACKAGES)' BENCH_PICTURES='$(@D)/pictures' $< $(ARGS) >$@.part && mv $@.part $@ || \
      { echo 'failed: bench $(@F:.tsv=)' >&2; false; }; }
bench: $(BENCHES:%=$(OUT)/%.tsv)
	@cat $^
$(OUT)/%.tsv: $(B)/bench/bench_% FORCE
	@$(RUN_BENCH)
.PRECIOUS: $(B)/bench/bench_%
.PHONY: FORCE
FORCE:

# the same tables on the machine's GPU, through EGL
GPU_BENCHES := $(patsubst tests/bench/gpu_%.c,%,$(wildcard $(if $(LIB),tests/bench/gpu_$(LIB).c,tests/bench/gpu_*.c)))
$(B)/bench/gpu_%: tests/bench/gpu_%.c
	$(COMPILE_C) -Itests/bench $(PICTURES) $< -o $@ $(PICTURE_LIBS) $(LDLIBS)
gpu-bench: export LIGHTSCAN_GL := $(or $(LIGHTSCAN_GL),egl)
gpu-bench: $(GPU_BENCHES:%=$(OUT)/gpu_%.tsv)
	@cat $^
$(OUT)/gpu_%.tsv: $(B)/bench/gpu_% FORCE
	@$(RUN_BENCH)
$(OUT)/size.tsv: FORCE
	@mkdir -p $(@D)
	@QUICK='$(QUICK)' SMOKE='$(SMOKE)' bash tests/size.sh $(LIBS) >$@

# A short run (QUICK, SMOKE) does two things at a time, the longest compilation first; a full one times one bench alone.
# SMOKE=1 shows that all benches work, its figures say nothing.
report: SHORT = $(if $(QUICK)$(SMOKE),-j2)
report:
	@NO_DEPS='$(NO_DEPS)$(NO_PACKAGES)' sh tests/deps.sh gnuplot-nox
	@rm -f $(BENCHES:%=$(OUT)/%.tsv)
	+@$(if $(SHORT),,$(MAKE) --no-print-directory -k -j2 $(BENCHES:%=$(B)/bench/bench_%) || true)
	+@$(MAKE) --no-print-directory -k $(SHORT) $(LONGEST_FIRST:%=$(OUT)/%.tsv) $(OUT)/size.tsv || true
	@mkdir -p $(REPORT)
	@REPORT_FLAGS='$(CC) -std=c99 $(OPT) $(CFLAGS)' REPORT_SHORT='$(if $(SMOKE),SMOKE=1,$(if $(QUICK),QUICK=1))' bash tests/report.sh $(BENCHES:%=$(OUT)/%.tsv) $(wildcard $(OUT)/gpu_*.tsv) $(OUT)/size.tsv >$(REPORT)/index.html.part
	@mv $(REPORT)/index.html.part $(REPORT)/index.html
	@echo $(REPORT)/index.html
	@failed=; for b in $(BENCHES); do [ -s $(OUT)/$$b.tsv ] || failed="$$failed $$b"; done; \
	 [ -z "$$failed" ] || { echo "failed:$$failed (not built, or ended with an error: see above)$(if $(HAVE_CXX),,; sat and tonemap need a C++ compiler: apt-get install g++)" >&2; exit 1; }

# ---- the rest --------------------------------------------------------------------------------------------------

help:
	@echo 'make demo      render the showcase to out/demo.png        [IN=picture.exr] [ARGS=...]'
	@echo 'make test      run all tests                              [LIB=sat] [ARGS="-v word"]'
	@echo 'make bench     error against run time, out/bench/*.tsv    [LIB=sat] [QUICK=1]'
	@echo 'make examples  build all programs of examples/ into build/'
	@echo 'make size      bytes of machine code of each header, with and without each option'
	@echo 'make check-strict     warnings, linkage, names, macros, options, order of inclusion'
	@echo 'make check-house      names that other headers take, stack, NULL arguments, comments against tables'
	@echo 'make check-variants   the tests without SIMD, with AVX2, without optimisation, with clang, -ffast-math, -Ofast, GNU C'
	@echo 'make check-asan       the tests under AddressSanitizer and UBSan; check-tsan: ThreadSanitizer'
	@echo 'make check-analyze    gcc -fanalyzer, clang --analyze; check-compilers: aarch64, mingw-w64, tcc, 32 bit'
	@echo 'make check-report     every bench once, with all packages and with none: the report is whole'
	@echo 'make check-install    what make install writes, by pkg-config, CMake and Meson'
	@echo 'make check-doors      the steps of README.md and docs/, line by line, without packages'
	@echo 'make check-glsl       every shader, in every combination of options, through glslangValidator'
	@echo 'make format-check     columns, tabs and blanks of all sources'
	@echo 'make fuzz             libFuzzer on each header          [FUZZ_SECONDS=20]'
	@echo 'make check            all of check-*; each takes LIB=sat'
	@echo 'make deps      install missing packages (Debian)'
	@echo 'make gpu-bench the OpenGL tables on the GPU (EGL), out/bench/gpu_*.tsv'
	@echo 'make web       the demo in a browser: out/web/index.html  [needs emscripten]'
	@echo 'make check-view the window and the page against the demo: Xvfb, headless Chromium'
	@echo 'make report    all tables and plots in report/index.html  [QUICK=1, SMOKE=1]'
	@echo 'make docs      put the programs of tests/test_readme.h into README.md and docs/, and the plots of the last bench'
	@echo 'make data      fetch free environment maps and meshes into data/'
	@echo 'make dist      one-file editions in dist/: each header with what it needs of sat.h inside'
	@echo 'make install   headers, lightscan.pc, CMake files                 [PREFIX=/usr/local] [DESTDIR=]'
	@echo 'make clean     remove build/, out/, dist/ and report/'

# one-file editions: each header with what it needs of sat.h inside
dist: $(patsubst %,dist/%,$(wildcard $(FAMILY:=.h)))
dist/sat.h: sat.h
	@mkdir -p dist
	cp $< $@
dist/%.h: %.h sat.h tests/make_dist.awk
	@mkdir -p dist
	awk -f tests/make_dist.awk sat.h $< >$@

# README.md and docs/*.md: programs from tests/test_readme.h, plots from the tables of the last `make bench` or `make report`
docs:
	@mkdir -p build
	PLOTS=docs bash tests/report.sh $(wildcard $(FAMILY:%=out/bench/%.tsv)) >build/report.html
	for page in README.md docs/*.md; do sh tests/readme.sh $$page out/bench >build/page.md && cp build/page.md $$page; done

# inputs for examples, into data/
data:
	@sh examples/data.sh data

PREFIX  ?= /usr/local
DESTDIR ?=
VERSION = $(shell awk '/define SAT_VERSION_(MAJOR|MINOR|PATCH)/ { printf "%s%s", dot, $$3; dot = "." }' sat.h)
install:
	install -d '$(DESTDIR)$(PREFIX)/include' '$(DESTDIR)$(PREFIX)/share/pkgconfig' '$(DESTDIR)$(PREFIX)/share/cmake/lightscan'
	install -m 644 $(wildcard $(FAMILY:=.h)) '$(DESTDIR)$(PREFIX)/include'
	printf '%s\n' 'prefix=$(PREFIX)' 'includedir=$${prefix}/include' '' 'Name: lightscan' \
	    'Description: Summed-area tables, tone mapping, ambient occlusion, soft shadows, rain and photomosaics in single headers' \
	    'Version: $(VERSION)' 'Cflags: -I$${includedir}' 'Libs: -lm' >'$(DESTDIR)$(PREFIX)/share/pkgconfig/lightscan.pc'
	install -m 644 tests/lightscan-config.cmake.in '$(DESTDIR)$(PREFIX)/share/cmake/lightscan/lightscan-config.cmake'
	sed 's/@VERSION@/$(VERSION)/' tests/lightscan-config-version.cmake.in \
	    >'$(DESTDIR)$(PREFIX)/share/cmake/lightscan/lightscan-config-version.cmake'

clean:
	rm -rf build out dist report

-include $(wildcard build/*.d build/*/*.d build/*/*/*.d)
