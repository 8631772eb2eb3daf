# SPDX-License-Identifier: MIT
# A few lines over CMakePresets.json and a Python environment in build/venv. `make help` lists the targets.
MAKEFLAGS += --no-print-directory
export CMAKE_BUILD_PARALLEL_LEVEL ?= $(shell nproc)
export PYTHON3
export CTEST_PARALLEL_LEVEL ?= $(shell nproc)
PYTHON := build/venv/bin/python
PYTEST := $(PYTHON) -m pytest
QUICK := "not rig and not clang and not logic"
SETUP := host_tools/setup
FUZZ_SECONDS ?= 60
# Of check-all, which judges every change by the same random trees. `make test-differential` takes new ones each time.
SEED := 20261123
PORTABLE := i686 powerpc asan-clang asan-i686 asan-i686-clang ubsan-powerpc msan tsan
BUILD = cmake --preset $(1) && cmake --build --preset $(1)

.PHONY: help demo test lint format check-all bench clean test-host test-firmware test-python test-rig test-clang test-asan
.PHONY: coverage figures golden fuzz proof test-logic test-portable test-trace mutation mutation-sample long-run kill-run
.NOTPARALLEL:

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' Makefile | expand -t 12

demo: ## build both example applications and watch them bring the robot home (under a minute)
	$(SETUP)/ensure-packages demo
	$(SETUP)/make-venv --try lcm can
	$(call BUILD,demo)
	build/venv/bin/canopy demo --build-dir build/host

test: ## install what is missing, build, run every test (QEMU and vcan included), quick ones first
	$(SETUP)/ensure-packages test
	$(SETUP)/make-venv can,lcm,plot,test,verify,differential,bench
	@$(MAKE) test-host test-firmware test-python test-rig

test-host: # unit tests on this machine
	$(call BUILD,host)
	ctest --preset host

test-firmware: # the same tests as firmware in QEMU, and the sizes of the code for Cortex-M0+ and Cortex-M4
	$(call BUILD,firmware-m0plus)
	$(call BUILD,firmware-m4)
	ctest --preset firmware-m0plus
	ctest --preset firmware-m4
	cmake --build --preset firmware-m0plus --target sizes
	cmake --build --preset firmware-m4 --target sizes

test-python: # Python and integration tests that need no CAN interface, in two halves at the same time
	@mkdir -p build && echo "half of the tests writes to build/test-python.log, which is shown at the end"
	@$(PYTEST) -m $(QUICK) --ignore-glob='*/integration/test_[a-h]*.py' > build/test-python.log 2>&1 & half=$$!; \
	$(PYTEST) -m $(QUICK) tests/integration/test_[a-h]*.py; first=$$?; \
	wait $$half; second=$$?; cat build/test-python.log; test $$first -eq 0 && test $$second -eq 0

test-rig: # integration tests on vcan0: one guest for all of them
	$(PYTHON) tests/rig/with-vcan --timeout 1800 --mem 1G -- $(PYTEST) -m rig

golden: ## write tests/golden anew from what the compiler makes now; read the diff before you commit it
	CANOPY_UPDATE_GOLDEN=1 $(PYTEST) tests/integration/test_golden.py

figures: ## draw the phase portraits of docs/figures from the models of examples/
	$(SETUP)/make-venv can,lcm,plot,test,verify,differential,bench
	PYTHONPATH=tests $(PYTHON) -m theory.figures

lint: ## formatters, linters and type checker; nothing is changed
	$(SETUP)/ensure-packages lint
	$(SETUP)/make-venv can,lcm,plot,test,verify,differential,bench,lint
	$(call BUILD,host)
	$(SETUP)/lint

format: ## let clang-format and ruff rewrite the sources
	$(SETUP)/ensure-packages demo
	$(SETUP)/make-venv can,lcm,plot,test,verify,differential,bench,lint
	$(SETUP)/lint --fix

check-all: ## what takes longer: clang, 20,000 random trees, the sanitizers under every test that runs a program and needs no CAN
	$(SETUP)/ensure-packages check-all
	$(SETUP)/make-venv can,lcm,plot,test,verify,differential
	@CANOPY_SEED=$${CANOPY_SEED:-$(SEED)} $(MAKE) test-clang test-logic test-portable coverage test-differential test-asan mutation-sample fuzz

test-clang: # the unit tests, and the tests of generated C that need a second compiler
	$(call BUILD,clang)
	ctest --preset clang
	$(PYTEST) -m clang

test-portable: # 32 bit, big-endian, and the sanitizers there and with clang: the unit tests
	@for preset in $(PORTABLE); do $(call BUILD,$$preset) && ctest --preset $$preset || exit 1; done

coverage: ## lines, branches and MC/DC of the runtime under the unit tests without threads; fails below 100 %
	$(SETUP)/ensure-packages coverage
	$(SETUP)/make-venv can,lcm,test
	$(call BUILD,coverage)
	rm -rf build/coverage/profiles
	LLVM_PROFILE_FILE="$(CURDIR)/build/coverage/profiles/%m-%p.profraw" ctest --preset coverage -E _threads # they cover by chance
	$(PYTHON) tests/coverage/report.py build/coverage runtime

test-differential: # 20,000 random trees against the model and BehaviorTree.CPP, with a new seed unless one is given
	$(call BUILD,host)
	CANOPY_TREES=$${CANOPY_TREES:-20000} CANOPY_SEED=$${CANOPY_SEED:-$$(date +%s)} $(PYTEST) tests/differential

test-logic: # canopy verify --never and --always: circuits, and what berkeley-abc says of them
	$(SETUP)/ensure-packages logic
	$(SETUP)/make-venv can,lcm,test,verify,differential
	$(PYTEST) -m logic tests/logic

test-trace: # the trace with losses: a million ticks for each way to lose frames, and for each decoder; in CI far fewer
	$(call BUILD,host)
	@seed=$${CANOPY_SEED:-$$(date +%s)} && build/host/tests/trace/trace_trial 7000000 $$seed && \
	CANOPY_TRACE_TICKS=$${CANOPY_TRACE_TICKS:-1000000} CANOPY_SEED=$$seed $(PYTEST) -s --timeout 3600 tests/integration/test_trace_losses.py tests/integration/test_trace_decoders.py

test-asan:
	$(call BUILD,asan)
	ctest --preset asan
	CANOPY_BUILD_DIR=build/asan $(PYTEST) -m $(QUICK) tests/integration tests/differential

mutation: ## change the runtime a little, 3,000 times, and see whether a unit test notices (an hour on two idle cores)
	$(call BUILD,asan)
	PYTHONPATH=tests $(PYTHON) -m mutation build/asan --jobs $(CMAKE_BUILD_PARALLEL_LEVEL)

mutation-sample: # 25 of them, in files of which all is known
	$(call BUILD,asan)
	PYTHONPATH=tests $(PYTHON) -m mutation build/asan --jobs $(CMAKE_BUILD_PARALLEL_LEVEL) --sample 25 --seed $${CANOPY_SEED:-$$(date +%s)}

long-run: ## an hour at 1 ms with robot, monitor, bridge and record: SECONDS=3600
	$(call BUILD,host)
	PYTHONPATH=tests $(PYTHON) -m endurance long --seconds $${SECONDS:-3600}

kill-run: ## kill -9 of any of these programs, TIMES=50 times, at random
	$(call BUILD,host)
	PYTHONPATH=tests $(PYTHON) -m endurance kill --times $${TIMES:-50} --seed $${CANOPY_SEED:-$$(date +%s)}

fuzz: ## libFuzzer on tables, images, states, frames and traces; then hostile files to C to the machine: FUZZ_SECONDS=60 each
	$(SETUP)/ensure-packages fuzz
	$(SETUP)/make-venv can,test
	$(call BUILD,fuzz)
	$(PYTHON) tests/fuzz/run.py build/fuzz $(FUZZ_SECONDS)
	PYTHONPATH=tests $(PYTHON) -m fuzz.generated --seconds $(FUZZ_SECONDS) --seed $${CANOPY_SEED:-$$(date +%s)} --keep build/fuzz/found/generated

proof: ## Frama-C on the engine, the loop, the codecs and the rings, for any input (installs 1.2 GB)
	$(SETUP)/ensure-packages proof
	$(SETUP)/make-venv can
	$(PYTHON) tests/proof/run.py

bench: ## instructions, stack and memory of a tick, instructions of cycles, next to other engines; rewrites the tables of docs/benchmarks.md
	$(SETUP)/ensure-packages bench
	$(SETUP)/make-venv can,lcm,plot,test,verify,differential,bench
	PYTHONPATH=tests $(PYTHON) -m bench --json build/bench.json --page docs/benchmarks.md

clean: ## remove everything that was built
	rm -rf build
