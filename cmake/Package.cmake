# Debian packages of what `cmake --install` installs, made by scripts/make_packages.sh: stillmap, libstillmap-dev and
# python3-stillmap. dpkg-shlibdeps finds the libraries that programs depend on, so the packages fit the distribution on
# which they are made; it is part of their version.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "Stillmap maintainers <maintainers@stillmap.invalid>")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_COMPONENTS_ALL command development)
if(TARGET stillmap_python)
  list(APPEND CPACK_COMPONENTS_ALL python)
endif()
set(CPACK_OUTPUT_FILE_PREFIX packages)
set(CPACK_PRE_BUILD_SCRIPTS "${PROJECT_SOURCE_DIR}/cmake/package_documents.cmake")

cmake_host_system_information(RESULT distribution QUERY DISTRIB_ID)
cmake_host_system_information(RESULT release QUERY DISTRIB_VERSION_ID)
set(CPACK_DEBIAN_PACKAGE_RELEASE "1~${distribution}${release}")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SOURCE stillmap)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
# OpenVINO's libraries come from a wheel and are packaged with the plug-in.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS_PRIVATE_DIRS "${openvino_folder}")
set(same_version "(= ${PROJECT_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE})")

set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "")  # each component's description begins with its own
set(CPACK_DEBIAN_COMMAND_PACKAGE_NAME stillmap)
set(CPACK_DEBIAN_COMMAND_PACKAGE_SECTION science)
set(CPACK_COMPONENT_COMMAND_DESCRIPTION "RGB-D SLAM for dynamic scenes
Estimates the trajectory of a depth camera, builds a static, colored 3D map
without moving people and objects, and tracks the moving ones. This package
contains the command and its networks' back end for CPUs.")

# The packages that find_package(Stillmap) and linking the static library need: cmake/StillmapConfig.cmake.in.
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libstillmap-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS "stillmap ${same_version}, libopencv-dev, libeigen3-dev, libceres-dev, \
libdeflate-dev, libpng-dev, libjpeg-dev, libtiff-dev, libopenexr-dev, libfmt-dev, libyaml-cpp-dev, liboctomap-dev, libmeshoptimizer-dev, libbz2-dev, liblz4-dev, \
libzstd-dev, libsqlite3-dev, libcivetweb-dev, libapriltag-dev, libcurl4-openssl-dev, libmosquitto-dev")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION "RGB-D SLAM for dynamic scenes (C++ library)
Static library, headers and CMake package of Stillmap, which estimates the
trajectory of a depth camera and a map without moving people and objects.")

set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-stillmap)
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
if(TARGET stillmap_python)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  math(EXPR next_minor "${Python3_VERSION_MINOR} + 1")
  set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
      "python3 (>= 3.${Python3_VERSION_MINOR}), python3 (<< 3.${next_minor}), python3-numpy")
endif()
# They make and remove the bytecode of the module.
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA "${PROJECT_SOURCE_DIR}/cmake/debian/python/postinst;\
${PROJECT_SOURCE_DIR}/cmake/debian/python/prerm")
set(CPACK_DEBIAN_PYTHON_PACKAGE_RECOMMENDS "stillmap ${same_version}")
set(CPACK_COMPONENT_PYTHON_DESCRIPTION "RGB-D SLAM for dynamic scenes (Python module)
Python module of Stillmap, which estimates the trajectory of a depth camera
and a map without moving people and objects.")
include(CPack)
