# Toolchain of the preset arm64: Debian's cross compiler, libraries of the root that scripts/make_arm64_root.sh unpacks,
# and QEMU's user mode, which runs programs and tests as the processor of the Raspberry Pi 5.
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_LIBRARY_ARCHITECTURE aarch64-linux-gnu)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)
set(CMAKE_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../build/arm64_root")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
set(CMAKE_CROSSCOMPILING_EMULATOR qemu-aarch64 -cpu cortex-a76 -L "${CMAKE_SYSROOT}")

# The Python module is for the root's Python; its interpreter is not run.
file(GLOB python "${CMAKE_SYSROOT}/usr/include/python3.*")
set(Python3_INCLUDE_DIR "${python}" CACHE PATH "")
string(REGEX REPLACE ".*python3[.]([0-9]+)$" "cpython-3\\1-aarch64-linux-gnu" soabi "${python}")
set(STILLMAP_PYTHON_SOABI "${soabi}" CACHE STRING "")
