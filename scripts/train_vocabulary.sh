#!/bin/sh
# SPDX-License-Identifier: Apache-2.0
# Creates stillmap/feature/vocabulary.bin: renders empty rooms of many seeds from many viewpoints, and trains the
# vocabulary on the images. Ten minutes on two cores; deterministic.
# Only needed when the descriptors, the simulator's rooms or the file's layout change.
#
#   scripts/train_vocabulary.sh [SCRATCH_FOLDER]    (default: build/vocabulary; existing images are reused)
set -eu
export LC_ALL=C  # the order of the folders
cd "$(dirname "$0")/.."
stillmap=build/release/stillmap
scratch=${1:-build/vocabulary}

render() {  # camera, frames, frames per second, seed
  folder="$scratch/$1_$4"
  test -e "$folder/associations.txt" && return  # the last file written
  "$stillmap" simulate --people 0 --camera "$1" --frames "$2" --fps "$3" --seed "$4" --out "$folder"
}

for seed in $(seq 1 48); do
  render loop 40 1 "$seed"
done
for seed in $(seq 49 64); do
  render halfsphere 10 0.5 "$seed"
  render rpy 10 0.7 "$seed"
done
"$stillmap" vocabulary train "$scratch"/*/rgb --out stillmap/feature/vocabulary.bin
