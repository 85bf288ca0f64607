# The radiosity pipeline: scene.obj -> .materials, .mesh -> .ff -> .sol -> .exr and .png
#
#   make -f pipeline.mk                                   the Cornell box, into out/
#   make -f pipeline.mk SCENE=path/name.obj OUT=folder    your scene, into folder/name.*
#   make -f pipeline.mk ERROR=0.01                        a finer picture
#   make -f pipeline.mk -j 4 SHARDS=4                     the matrix in four parts side by side
#   make -f pipeline.mk PASSES=2                          elements where the first solution is worst
#   make -f pipeline.mk report                            all on one page, out/name.html
#   make -f pipeline.mk test                              the tests
#   make -f pipeline.mk clean SCENE=... OUT=...           removes what was made for this scene
#
# Only what an edit touches runs again: a changed colour reruns solving and shading, a moved camera shading alone.
# Every tool leaves a file alone that it would write with the same bytes; a stage runs when a file it reads, its flags
# or its program is newer than its own last run. For each stage with output F there are
#
#   F.made    the stamp of its last run (its time is the start of that run), which depends on what the stage reads;
#   F         which depends on F.made with an empty recipe, so that make looks at F again after the stage and sees
#             whether it changed. F may be older than F.made. Later stages depend on F, so an unchanged F ends it there
#             (The empty recipe is written +: with a bare one, make -n and make -q take F for new.)
#   F.flags   the stage's program and flags as text, rewritten only where that text changed.
#
# A missing F, or a missing input, makes the stage run by way of FORCE. Only `clean` deletes anything.

ifeq ($(filter grouped-target,$(.FEATURES)),)
$(error pipeline.mk needs GNU make 4.3 or newer, this is $(MAKE_VERSION))
endif
.SUFFIXES:
.DEFAULT_GOAL := all

# ---- What a user sets ----------------------------------------------------------------------------------------------

# Folder of this file, ending in a slash, or nothing. Paths a user gives are relative to where make was called.
ROOT := $(patsubst ./%,%,$(dir $(lastword $(MAKEFILE_LIST))))
BIN  := $(or $(CARGO_TARGET_DIR),$(ROOT)target)/release/

SCENE ?= $(ROOT)tests/scenes/cornell_blocks.obj
OUT   ?= out
# Wished relative RMS error of the picture: mesh fineness and the stages' tolerances follow from it, see below.
ERROR ?= 0.02
# 2: mesh, factors and solution are made twice: half the elements first, then refined where that solution is worst. Elements
# that did not change keep their factors.
PASSES ?= 1
# 1: a stage that misses its tolerance (exit 3) stops the pipeline. Otherwise it warns and the pipeline goes on.
STRICT ?=
# Above 1: the matrix is computed in so many parts, which make -j runs side by side, and merged; the file is the same.
SHARDS ?= 1
# Added to a stage's command. A flag given here replaces the one that follows from ERROR.
MESH_FLAGS  ?=
FF_FLAGS    ?=
SOLVE_FLAGS ?=
SHADE_FLAGS ?=
# A stage's program. Any other with the same command line will do; the ones named here are built first.
MESH_TOOL       ?= $(BIN)mesh-tool
FORMFACTOR_TOOL ?= $(BIN)formfactor-tool
SOLVE_TOOL      ?= $(BIN)solve-tool
SHADE_TOOL      ?= $(BIN)shade-tool

# ---- ERROR -> mesh fineness and tolerances -------------------------------------------------------------------------

# The mesh decides the picture's error. The matrix tolerance bounds what the worst row states, the sum of all its |errors|, 25 times
# ERROR: the mean row states a tenth of that, and as errors have both signs the light changes by far less than a row is off. With 20 and
# 40 times ERROR in place of 10 the picture of the Cornell box changed by at most 0.16 % (RMS, ERROR 0.02 and 0.01), and a furnished room
# was no farther from the truth. What the solver proves takes all errors for one sign, so it is asked for five times ERROR, and stops its
# own iteration far below that. The picture's tolerance bounds what lies between nodes: with 2 times ERROR a furnished room was off by
# 2.5 % at 0.03, with 1.4 times by 1.2 %.
# A scene of many faces needs several elements for each before any can go where the light is, fewer for a rough picture. e is ERROR,
# faces their number in the OBJ.
define CALIBRATION
each = 0.14 / e; if (each > 11) each = 11;
elements = 30 / e + each * faces;
if (elements < 200) elements = 200;
if (elements > 20000) elements = 20000;
ff_tolerance = 25 * e; if (ff_tolerance > 0.9) ff_tolerance = 0.9;
solve_tolerance = 5 * e; if (solve_tolerance > 0.5) solve_tolerance = 0.5;
shade_tolerance = 1.4 * e; if (shade_tolerance > 0.5) shade_tolerance = 0.5;
endef

quote := '
quoted = $(quote)$(subst $(quote),$(quote)\$(quote)$(quote),$(strip $1))$(quote)
faces   := $(or $(shell grep -c '^[[:space:]]*f[[:space:]]' $(call quoted,$(SCENE)) 2> /dev/null),0)
derived := $(shell LC_ALL=C awk -v given=$(call quoted,$(ERROR)) -v faces=$(faces) 'BEGIN { e = given + 0; \
  if (given !~ /^[0-9]*[.]?[0-9]+([eE][-+]?[0-9]+)?$$/ || e <= 0 || e > 1) exit; \
  $(CALIBRATION) printf "%d %.6g %.6g %.6g", elements + 0.5, ff_tolerance, solve_tolerance, shade_tolerance }')
ifneq ($(words $(derived)),4)
$(error pipeline.mk: ERROR = $(ERROR): expected a number above 0 and at most 1, such as 0.02)
endif

# $(call unless,FLAGS,--a --b,DERIVED): DERIVED, unless FLAGS already say --a or --b.
unless = $(if $(filter $2 $(2:%=%=%),$1),,$3)
ifneq ($(filter-out 1 2,$(words $(PASSES)) $(PASSES)),)
$(error pipeline.mk: PASSES = $(PASSES): expected 1 or 2)
endif
twice := $(filter 2,$(PASSES))
elements    = $(if $(twice),$(shell expr $(word 1,$(derived)) / 2),$(word 1,$(derived)))
mesh_flags  = $(call unless,$(MESH_FLAGS),--elements --max-edge,--elements $(elements)) $(MESH_FLAGS)
ff_flags    = $(call unless,$(FF_FLAGS),--tolerance,--tolerance $(word 2,$(derived))) $(FF_FLAGS)
solve_flags = $(call unless,$(SOLVE_FLAGS),--tolerance,--tolerance $(word 3,$(derived))) $(SOLVE_FLAGS)

# Numbers of the shards; none where the matrix is computed in one piece.
shards := $(shell printf '%s' $(call quoted,$(SHARDS)) | grep -qE '^[1-9][0-9]{0,3}$$' && seq $(SHARDS))
ifeq ($(shards),)
$(error pipeline.mk: SHARDS = $(SHARDS): expected a whole number from 1 to 9999)
endif
shards := $(if $(filter-out 1,$(shards)),$(shards))

# The camera is the scene's toml where that has one; otherwise shade-tool frames the scene itself.
TOML := $(wildcard $(basename $(SCENE)).toml)
camera      := $(if $(TOML),$(shell grep -Eq '^[[:space:]]*(\[+[[:space:]]*)?camera' $(TOML) && echo --camera $(TOML)))
shade_flags  = $(call unless,$(SHADE_FLAGS),--camera,$(camera)) \
  $(call unless,$(SHADE_FLAGS),--tolerance,--tolerance $(word 4,$(derived))) $(SHADE_FLAGS)

# ---- Paths make cannot handle are refused before anything runs -----------------------------------------------------

open := (
shut := )
backslash := $(strip \)
empty :=
space := $(empty) $(empty)
awkward := $(open) $(shut) $(backslash) $(quote) : % & ; < > | * ? [ ] ! " `
bad-path = $(or $(filter-out 1,$(words $2)),$(strip $(foreach c,$(awkward),$(findstring $c,$2))))
checked-path = $(if $(call bad-path,$1,$2),$(error pipeline.mk: $1 = "$2": a path here is one word of letters, \
  digits and . _ - + / because make splits names at spaces; rename it, or link it under a plain name))
ifeq ($(wildcard $(lastword $(MAKEFILE_LIST))),)
$(error pipeline.mk: the path of this file holds a space; change to its folder and run "make -f pipeline.mk" there)
endif
$(call checked-path,SCENE,$(SCENE))
$(call checked-path,OUT,$(OUT))
ifeq ($(filter %.obj %.OBJ,$(SCENE)),)
$(error pipeline.mk: SCENE = $(SCENE): expected the path of an .obj file)
endif

# ---- What a stage depends on ---------------------------------------------------------------------------------------

# All outputs begin with this.
P := $(patsubst %/,%,$(strip $(OUT)))/$(basename $(notdir $(SCENE)))

# Inputs a user can take away: a missing one is left to the tool, whose message names the nearest file.
inputs  = $(foreach f,$1,$(if $(wildcard $f),$f,FORCE))
# Outputs: FORCE where one of them is missing, or where STRICT asks again what once went through with exit 3.
missing = $(if $(filter-out $(wildcard $1),$1),FORCE)
strict := $(filter-out 0 no,$(STRICT))
again   = $(call missing,$1) $(if $(strict),$(if $(filter 3,$(file <$(firstword $1).made)),FORCE))
# Files that flags name, such as another camera: not folders, not this pipeline's own outputs.
named   = $(foreach f,$(filter-out $(P).%,$(wildcard $(subst =, ,$1))),$(if $(wildcard $f/.),,$f))
# The files of a program: where the shell finds its first word, and further words that are files (python3 my_tool.py).
# `clean` and `test` need none of it.
tools   := mesh-tool formfactor-tool solve-tool shade-tool
built   := $(tools:%=$(BIN)%)
running := $(filter-out clean test stress fuzz faults,$(or $(MAKECMDGOALS),all))
find-program = $(or $(wildcard $(shell command -v $(firstword $2))),$(error pipeline.mk: $1 = "$2": no such program))
program = $(if $(running),$(if $(filter $(built),$($1)),$($1),\
  $(call find-program,$1,$($1)) $(call named,$(wordlist 2,99,$($1)))))

# Programs and flags as text. The scene's own path is part of it: another scene of the same name is another scene.
program-text = $(patsubst $(BIN)%,%,$1)
text.materials = $(call program-text,$(MESH_TOOL)) $(abspath $(SCENE)) $(notdir $(TOML))
text.mesh = $(call program-text,$(MESH_TOOL)) $(abspath $(SCENE)) $(mesh_flags) $(refine)
text.first.mesh = $(call program-text,$(MESH_TOOL)) $(abspath $(SCENE)) $(mesh_flags)
text.first.ff = $(call program-text,$(FORMFACTOR_TOOL)) $(ff_flags) $(raw)
text.first.sol = $(text.sol)
text.ff   = $(call program-text,$(FORMFACTOR_TOOL)) $(ff_flags) $(reuse)
text.sol  = $(call program-text,$(SOLVE_TOOL)) $(solve_flags)
text.exr  = $(call program-text,$(SHADE_TOOL)) $(subst $(TOML),$(abspath $(TOML)),$(shade_flags))

# With PASSES=2 the mesh is refined by the solution of the first pass, whose files are called NAME.first.*.
first  := $(P).first
refine := $(if $(twice),--refine-with $(first).sol)

# The second matrix takes the factors of elements that did not change from the first, which therefore is not closed. Programs
# that go by another name are not asked to, nor are methods that cannot.
reuses := $(and $(twice),$(filter formfactor-tool,$(notdir $(firstword $(FORMFACTOR_TOOL)))),$(call unless,$(FF_FLAGS),--method --reuse,yes))
reused := $(if $(reuses),$(first).ff $(first).mesh)
reuse  := $(if $(reuses),--reuse $(first).ff --reuse-mesh $(first).mesh)
raw    := $(if $(reuses),$(call unless,$(FF_FLAGS),--closure,--closure report))

# ---- How a stage runs: the one place that knows exit codes -----------------------------------------------------------

# $(call stage,COMMAND) says and runs COMMAND, then stamps $@ with the time the run began, so that an input edited
# meanwhile counts as newer. Exit 3 (written, tolerance missed) warns, or with STRICT stops; in both cases the output is
# kept. Any other failure stops without a stamp; the tool has left the old output as it was.
silent := $(findstring s,$(firstword -$(MAKEFLAGS)))
define stage
@: > $@.start
$(if $(silent),,@printf '%s\n' $(call quoted,$1))
@$(strip $1); code=$$?; case $$code:$(strict) in \
0:*) ;; \
3:) echo "pipeline.mk: warning: $(@:.made=): the asked tolerance was not reached; going on (STRICT=1 stops)" >&2 ;; \
3:*) echo "pipeline.mk: $(@:.made=): the asked tolerance was not reached; kept, stopping (STRICT)" >&2; exit 3 ;; \
*) exit $$code ;; \
esac; \
echo $$code > $@.new && touch -r $@.start $@.new && mv -f $@.new $@ && rm -f $@.start
endef

# ---- The stages ------------------------------------------------------------------------------------------------------

.PHONY: all install test clean FORCE
all: $(P).exr $(P).png
FORCE:

# Materials: colours, powers, and .surfaces, the little that geometry depends on. The depfile lists the MTL files.
materials_outputs := $(P).materials $(P).surfaces $(P).materials.d
listed := $(filter-out %: $(backslash),$(subst $(backslash)$(space),?,$(file <$(P).materials.d)))
$(P).materials.made: $(sort $(call inputs,$(SCENE) $(listed))) $(TOML) $(P).materials.flags \
    $(call program,MESH_TOOL) $(call again,$(materials_outputs))
	$(call stage,$(MESH_TOOL) materials $(SCENE) -o $(P).materials --depfile $(P).materials.d)
$(materials_outputs): $(P).materials.made ; +

# Mesh: the scene's faces cut into elements. Depends on .surfaces and not on the MTL, so colours leave it alone.
$(P).mesh.made: $(call inputs,$(SCENE)) $(P).surfaces $(P).mesh.flags $(call named,$(MESH_FLAGS)) \
    $(if $(twice),$(first).sol) $(call program,MESH_TOOL) $(call again,$(P).mesh)
	$(call stage,$(MESH_TOOL) build $(SCENE) -o $(P).mesh $(mesh_flags) $(refine))
$(P).mesh: $(P).mesh.made ; +

# The first of two passes, with the same flags: its elements that need no refinement are in the second mesh, too.
ifneq ($(twice),)
$(first).mesh.made: $(call inputs,$(SCENE)) $(P).surfaces $(first).mesh.flags $(call named,$(MESH_FLAGS)) \
    $(call program,MESH_TOOL) $(call again,$(first).mesh)
	$(call stage,$(MESH_TOOL) build $(SCENE) -o $(first).mesh $(mesh_flags))
$(first).mesh: $(first).mesh.made ; +
$(first).ff.made: $(first).mesh $(first).ff.flags $(call named,$(FF_FLAGS)) \
    $(call program,FORMFACTOR_TOOL) $(call again,$(first).ff)
	$(call stage,$(FORMFACTOR_TOOL) compute $(first).mesh -o $(first).ff $(ff_flags) $(raw))
$(first).ff: $(first).ff.made ; +
$(first).sol.made: $(first).ff $(first).mesh $(P).materials $(first).sol.flags $(call named,$(SOLVE_FLAGS)) \
    $(call program,SOLVE_TOOL) $(call again,$(first).sol)
	$(call stage,$(SOLVE_TOOL) solve $(first).ff --mesh $(first).mesh --materials $(P).materials -o $(first).sol $(solve_flags))
$(first).sol: $(first).sol.made ; +
endif

# Form factors: what every element sees of every other.
ifeq ($(shards),)
$(P).ff.made: $(P).mesh $(reused) $(P).ff.flags $(call named,$(FF_FLAGS)) \
    $(call program,FORMFACTOR_TOOL) $(call again,$(P).ff)
	$(call stage,$(FORMFACTOR_TOOL) compute $(P).mesh -o $(P).ff $(ff_flags) $(reuse))
else
# The same in parts: name.1of4.ff and so on, and what puts them together.
shard_files := $(shards:%=$(P).%of$(SHARDS).ff)
define shard_rule
$(P).$1of$(SHARDS).ff.made: $(P).mesh $(reused) $(P).ff.flags $$(call named,$$(FF_FLAGS)) \
    $$(call program,FORMFACTOR_TOOL) $$(call again,$(P).$1of$(SHARDS).ff)
	$$(call stage,$$(FORMFACTOR_TOOL) compute $(P).mesh -o $(P).$1of$(SHARDS).ff --shard $1/$(SHARDS) $$(ff_flags) $(reuse))
$(P).$1of$(SHARDS).ff: $(P).$1of$(SHARDS).ff.made ; +
endef
$(foreach i,$(shards),$(eval $(call shard_rule,$i)))
$(P).ff.made: $(shard_files) $(call program,FORMFACTOR_TOOL) $(call again,$(P).ff)
	$(call stage,$(FORMFACTOR_TOOL) merge $(shard_files) -o $(P).ff)
endif
$(P).ff: $(P).ff.made ; +

# Solution: radiosity and irradiance of every element, with the materials beside the mesh.
$(P).sol.made: $(P).ff $(P).mesh $(P).materials $(P).sol.flags $(call named,$(SOLVE_FLAGS)) \
    $(call program,SOLVE_TOOL) $(call again,$(P).sol)
	$(call stage,$(SOLVE_TOOL) solve $(P).ff --mesh $(P).mesh -o $(P).sol $(solve_flags))
$(P).sol: $(P).sol.made ; +

# Pictures: linear radiance as EXR, a preview as PNG.
$(P).exr.made: $(P).sol $(P).mesh $(P).materials $(TOML) $(P).exr.flags $(call named,$(SHADE_FLAGS)) \
    $(call program,SHADE_TOOL) $(call again,$(P).exr $(P).png)
	$(call stage,$(SHADE_TOOL) render $(P).sol --mesh $(P).mesh -o $(P).exr --png $(P).png $(shade_flags))
$(P).exr $(P).png: $(P).exr.made ; +

# Report: all of it on one page, name.html, which needs no network; with a solution that has bounds, and pictures made for it.
.PHONY: report
report: $(P).html
$(P).page.sol: $(P).sol
	$(SOLVE_TOOL) solve $(P).ff --mesh $(P).mesh -o $@ $(solve_flags) $(call unless,$(SOLVE_FLAGS),--bounds,--bounds) || [ $$? -eq 3 ]
	@touch $@
$(P).page.false-colour.png: $(P).exr
	$(SHADE_TOOL) view false-colour $(P).exr -o $@
	@touch $@
$(P).page.mesh.png: $(P).exr
	$(SHADE_TOOL) view mesh $(P).exr --mesh $(P).mesh -o $@
	@touch $@
$(P).page.matrix.png: $(P).ff
	$(FORMFACTOR_TOOL) picture $(P).ff -o $@
	@touch $@
$(P).html: $(P).exr $(P).png $(P).sol $(TOML) $(addprefix $(P).page.,sol false-colour.png mesh.png matrix.png) \
    $(call program,SHADE_TOOL)
	$(SHADE_TOOL) page $(P).sol --mesh $(P).mesh --matrix $(P).ff --picture $(P).exr --bounds $(P).page.sol \
	  --figure picture=$(P).png --figure false-colour=$(P).page.false-colour.png --figure mesh=$(P).page.mesh.png \
	  --figure matrix=$(P).page.matrix.png $(TOML:%=--camera %) -o $@
	@touch $@

# Flags: written first, and only where the text is another one (or the file is missing).
stages := materials mesh ff sol exr $(if $(twice),first.mesh first.ff first.sol)
same    = $(and $(findstring <$(strip $1)>,<$(strip $2)>),$(findstring <$(strip $2)>,<$(strip $1)>))
$(foreach s,$(stages),$(if $(call same,$(text.$s),$(file <$(P).$s.flags)),,$(P).$s.flags)): FORCE
$(stages:%=$(P).%.flags): $(P).%.flags:
	@mkdir -p $(@D)
	@printf '%s\n' $(call quoted,$(text.$*)) > $@

# ---- Building, testing, cleaning ---------------------------------------------------------------------------------------

cargo = @command -v cargo > /dev/null || { echo "pipeline.mk: cargo not found: install Rust (https://rustup.rs)" >&2; exit 1; }

# The tools, where a stage uses ours: cargo is asked when a source is newer than the last time, and leaves a program
# alone that did not change. MAKEFLAGS is kept from cargo, which would take make's job slots for its own.
ifneq ($(and $(running),$(filter $(built),$(MESH_TOOL) $(FORMFACTOR_TOOL) $(SOLVE_TOOL) $(SHADE_TOOL))),)
rooms := $(addprefix $(ROOT),interchange geometry $(tools))
sources := $(wildcard $(ROOT)Cargo.toml $(ROOT)Cargo.lock $(rooms:%=%/Cargo.toml)) $(shell find $(rooms:%=%/src))
$(BIN)pipeline.made: $(sources) $(call missing,$(built))
	$(cargo)
	@mkdir -p $(@D) && : > $@.start
	MAKEFLAGS= cargo build --release --workspace --manifest-path $(ROOT)Cargo.toml
	@mv -f $@.start $@
$(built): $(BIN)pipeline.made ; +
endif

# Programs, manual pages and completions (bash, zsh, fish) below PREFIX; DESTDIR in front of it for packages.
PREFIX ?= /usr/local
install: $(built)
	mkdir -p $(call quoted,$(DESTDIR)$(PREFIX)/bin)
	install -m 755 $(built) $(call quoted,$(DESTDIR)$(PREFIX)/bin)
	$(foreach t,$(built),$t pages $(call quoted,$(DESTDIR)$(PREFIX)) &&) true

# All tests, numbers included. The dev profile is optimised too, and links its many test programs in seconds.
test:
	$(cargo)
	MAKEFLAGS= cargo test --workspace --manifest-path $(ROOT)Cargo.toml

# Removes what the stages made for this scene, and what a killed stage left half written; nothing else in the folder.
outputs := $(materials_outputs) $(P).mesh $(P).ff $(P).sol $(P).exr $(P).png \
  $(addprefix $(P).first.,mesh ff sol materials surfaces)
hidden  := $(dir $(P)).$(notdir $(P))
clean:
	rm -f $(outputs) $(outputs:%=%.report.json)
	rm -f $(P).html $(addprefix $(P).page.,sol sol.report.json false-colour.png mesh.png matrix.png)
	rm -f $(addprefix $(P).page.,$(addsuffix .report.json,false-colour.png mesh.png matrix.png))
	rm -f $(foreach s,$(stages) first.mesh first.ff first.sol,$(addprefix $(P).$s,.flags .made .made.start .made.new))
	rm -f $(foreach f,$(outputs:$(P)%=$(hidden)%),$f.*.partial $f.report.json.*.partial $f.*.mode)
	rm -f $(foreach e,.ff .ff.report.json .ff.made .ff.made.start .ff.made.new,$(P).[1-9]*of[1-9]*$e)
	rm -f $(addprefix $(hidden).[1-9]*of[1-9]*.ff.,*.partial report.json.*.partial *.mode)

# ---- Proof: time against error, stress, damage, skips ------------------------------------------------------------------

# BENCHMARKS.md says what is measured. A bench takes 40 minutes at most and, interrupted or out of time, goes on when called again;
# BENCH_FLAGS="--scenes cornell_empty --minutes 3" does a part, and `skips` without SCENE measures the reference scenes.
BENCH_FLAGS ?=
.PHONY: bench reference skips stress fuzz faults
bench reference: $(built)
	$(cargo)
	MAKEFLAGS= cargo bench --quiet -p tests --bench proof --manifest-path $(ROOT)Cargo.toml -- $@ $(BENCH_FLAGS)
skips: $(built)
	$(cargo)
	MAKEFLAGS= cargo bench --quiet -p tests --bench proof --manifest-path $(ROOT)Cargo.toml -- skips \
	  $(if $(filter file,$(origin SCENE)),,--scene $(abspath $(SCENE)) --errors $(ERROR)) $(BENCH_FLAGS)
# The stress table, each row with the number it must meet.
stress:
	$(cargo)
	STRESS_INTO=$(abspath $(ROOT)BENCHMARKS.md) MAKEFLAGS= cargo test --release -p tests --test stress \
	  --manifest-path $(ROOT)Cargo.toml -- --nocapture
# Every fuzz body for T seconds, one after another, by seeded changes on stable Rust; fuzz/ has the same bodies for cargo-fuzz.
T ?= 600
fuzz:
	$(cargo)
	FUZZ_SECONDS=$(T) MAKEFLAGS= cargo test --release -p tests --test fuzz --manifest-path $(ROOT)Cargo.toml \
	  -- --nocapture --test-threads 1
# kill -9 at 200 moments, 1,000 damaged files; the ordinary tests do a part of it with the same seeds.
faults:
	$(cargo)
	FAULTS=full MAKEFLAGS= cargo test --release -p tests --test faults --test pipeline_real --manifest-path $(ROOT)Cargo.toml \
	  -- --nocapture
