#!/usr/bin/env bash
# SPDX-License-Identifier: Apache-2.0
#
# Builds OpenCV, Ceres and libtiff for the wheels (scripts/make_wheels.py) as static libraries, from this Debian's sources,
# into build/wheel_dependencies/ARCHITECTURE: the modules that Stillmap uses, without the packages' several hundred
# further libraries, of which some (x265, Poppler, SuiteSparse, JBIG-KIT) are under the GPL.
#
#   scripts/build_wheel_dependencies.sh           for this computer
#   scripts/build_wheel_dependencies.sh arm64     for 64-bit ARM (after scripts/make_arm64_root.sh)
set -euo pipefail
cd "$(dirname "$0")/.."

target=${1:-native}
prefix=$PWD/build/wheel_dependencies/$target

[ ! -e "$prefix/ceres-solver.made" ] || exit 0
scripts/install_dependencies.sh --wheels

# --- Sources ---
sources=$PWD/build/wheel_dependencies/sources
mkdir -p "$sources/lists"
# shellcheck source=/dev/null
. /etc/os-release
echo "deb-src [signed-by=/usr/share/keyrings/debian-archive-keyring.gpg] http://deb.debian.org/debian $VERSION_CODENAME main" \
  >"$sources/sources.list"
apt=(apt-get -q -o "Dir::Etc::sourcelist=$sources/sources.list" -o Dir::Etc::sourceparts=-
     -o "Dir::State::lists=$sources/lists" -o APT::Sandbox::User=)
if [ ! -e "$sources/unpacked" ]; then
  "${apt[@]}" update
  (cd "$sources" && "${apt[@]}" source --download-only opencv ceres-solver tiff)
  for archive in "$sources"/{opencv,ceres-solver,tiff}_*.orig.tar.[bx]z*; do
    tar -xf "$archive" -C "$sources"
  done
  touch "$sources/unpacked"
fi

# --- Build ---
flags="-ffp-contract=off -g0 -ffile-prefix-map=$sources="
common=(-G Ninja -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$prefix" -DCMAKE_PREFIX_PATH="$prefix"
        -DBUILD_SHARED_LIBS=OFF -DCMAKE_POSITION_INDEPENDENT_CODE=ON -DCMAKE_CXX_FLAGS="$flags" -DCMAKE_C_FLAGS="$flags")
[ "$target" = native ] || common+=(-DCMAKE_TOOLCHAIN_FILE="$PWD/cmake/$target.cmake" -DCMAKE_FIND_ROOT_PATH="$prefix")
[ -z "$(command -v ccache)" ] || common+=(-DCMAKE_C_COMPILER_LAUNCHER=ccache -DCMAKE_CXX_COMPILER_LAUNCHER=ccache)

# build SOURCES OPTION...
build() {
  local name=$1 log=$prefix/$1.log
  [ ! -e "$prefix/$name.made" ] || return 0
  shift
  mkdir -p "$prefix"
  { cmake -S "$sources"/"$name"-* -B "$prefix/build/$name" "${common[@]}" "$@" &&
    cmake --build "$prefix/build/$name" --parallel "${JOBS:-$(nproc)}" &&
    cmake --install "$prefix/build/$name"; } >"$log" 2>&1 || { tail -n 50 "$log" >&2; exit 1; }
  rm -rf "$prefix/build/$name"
  touch "$prefix/$name.made"
}

build libtiff -Djbig=OFF -Dlerc=OFF -Dlibdeflate=OFF -Dlzma=OFF -Dzstd=OFF -Dwebp=OFF -Dtiff-tools=OFF -Dtiff-tests=OFF \
  -Dtiff-contrib=OFF -Dtiff-docs=OFF
# The instruction sets are those of Debian's package.
build opencv -DBUILD_LIST=core,imgproc,features2d,calib3d,video,dnn -DCPU_BASELINE_DISABLE=SSE3 \
  -DBUILD_TESTS=OFF -DBUILD_PERF_TESTS=OFF -DBUILD_EXAMPLES=OFF -DBUILD_opencv_apps=OFF -DBUILD_JAVA=OFF \
  -DBUILD_opencv_python3=OFF -DENABLE_PRECOMPILED_HEADERS=OFF -DOPENCV_GENERATE_PKGCONFIG=OFF \
  -DBUILD_PROTOBUF=OFF -DPROTOBUF_UPDATE_FILES=ON -DWITH_PROTOBUF=ON -DWITH_IPP=OFF -DWITH_ITT=OFF -DWITH_TBB=OFF -DWITH_OPENCL=OFF \
  -DWITH_LAPACK=OFF -DWITH_EIGEN=OFF -DWITH_CAROTENE=OFF -DWITH_VA=OFF -DWITH_GTK=OFF -DWITH_QUIRC=OFF -DWITH_ADE=OFF \
  -DWITH_FFMPEG=OFF -DWITH_GSTREAMER=OFF -DWITH_V4L=OFF -DWITH_1394=OFF -DWITH_JASPER=OFF -DWITH_OPENJPEG=OFF \
  -DWITH_OPENEXR=OFF -DWITH_GDAL=OFF -DWITH_GDCM=OFF -DWITH_TIFF=OFF -DWITH_WEBP=OFF -DWITH_PNG=OFF -DWITH_JPEG=OFF \
  -DBUILD_ZLIB=OFF
build ceres-solver -DMINIGLOG=ON -DGFLAGS=OFF -DSUITESPARSE=OFF -DCXSPARSE=OFF -DLAPACK=OFF -DACCELERATESPARSE=OFF \
  -DEIGENSPARSE=ON -DSCHUR_SPECIALIZATIONS=OFF -DCUDA=OFF -DUSE_CUDA=OFF -DBUILD_TESTING=OFF -DBUILD_EXAMPLES=OFF -DBUILD_BENCHMARKS=OFF \
  -DPROVIDE_UNINSTALL_TARGET=OFF
