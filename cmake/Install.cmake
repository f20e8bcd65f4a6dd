# `cmake --install` installs two components:
#   - command: the command with its manual page, documents, shell completion, presets and license, and the OpenVINO
#     plug-in with the libraries of OpenVINO that it needs;
#   - development: for other projects, one library, the public headers, and a CMake package for find_package(Stillmap).
# The target stillmap_installed builds all that is installed and nothing else.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
include(PublicHeaders)
set(package_folder ${CMAKE_INSTALL_LIBDIR}/cmake/Stillmap)
set(plugin_folder ${CMAKE_INSTALL_LIBDIR}/stillmap)

# --- The command ---
set_target_properties(stillmap PROPERTIES INSTALL_RPATH "$ORIGIN/../${plugin_folder}")
set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME command)
install(TARGETS stillmap)
install(FILES "${PROJECT_SOURCE_DIR}/LICENSE" "${PROJECT_SOURCE_DIR}/README.md" DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY "${PROJECT_SOURCE_DIR}/docs" DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY "${PROJECT_SOURCE_DIR}/presets" DESTINATION ${CMAKE_INSTALL_DATADIR}/stillmap
        FILES_MATCHING PATTERN *.yaml)

# The program itself writes its manual page and completion, so that they always list the options it has.
list(JOIN CMAKE_CROSSCOMPILING_EMULATOR " " run_stillmap)
string(APPEND run_stillmap " '$<TARGET_FILE:stillmap>'")
set(man_page "${PROJECT_BINARY_DIR}/stillmap.1.gz")
set(bash_completion "${PROJECT_BINARY_DIR}/stillmap.bash")
set(zsh_completion "${PROJECT_BINARY_DIR}/stillmap.zsh")
add_custom_command(OUTPUT "${man_page}" "${bash_completion}" "${zsh_completion}"
                   COMMAND sh -c "${run_stillmap} man | gzip -9n >'${man_page}'"
                   COMMAND sh -c "${run_stillmap} completion bash >'${bash_completion}'"
                   COMMAND sh -c "${run_stillmap} completion zsh >'${zsh_completion}'"
                   DEPENDS stillmap VERBATIM)
add_custom_target(stillmap_manual ALL DEPENDS "${man_page}" "${bash_completion}" "${zsh_completion}")
install(FILES "${man_page}" DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES "${bash_completion}" DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions RENAME stillmap)
install(FILES "${zsh_completion}" DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/site-functions RENAME _stillmap)

# --- The OpenVINO plug-in ---
# The libraries of a wheel are copied next to the plug-in; the loader finds those in system folders itself.
if(TARGET stillmap_openvino)
  install(TARGETS stillmap_openvino LIBRARY DESTINATION ${plugin_folder})
  get_target_property(openvino_library openvino::runtime IMPORTED_LOCATION_RELEASE)
  cmake_path(GET openvino_library PARENT_PATH openvino_folder)
  if(NOT openvino_folder IN_LIST CMAKE_CXX_IMPLICIT_LINK_DIRECTORIES)
    list(TRANSFORM STILLMAP_OPENVINO_LIBRARIES PREPEND "${openvino_folder}/" OUTPUT_VARIABLE patterns)
    file(GLOB openvino_files ${patterns})
    install(FILES ${openvino_files} DESTINATION ${plugin_folder})
    file(GLOB openvino_licenses "${openvino_folder}/../../openvino-*.dist-info/licenses/*")
    foreach(license IN LISTS openvino_licenses)
      if(IS_DIRECTORY "${license}")
        install(DIRECTORY "${license}" DESTINATION ${CMAKE_INSTALL_DOCDIR}/openvino)
      else()
        install(FILES "${license}" DESTINATION ${CMAKE_INSTALL_DOCDIR}/openvino)
      endif()
    endforeach()
  endif()
endif()

set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)

# --- The library: the objects of all modules in one archive, Stillmap::stillmap ---
get_property(modules GLOBAL PROPERTY STILLMAP_MODULES)
get_property(module_libraries GLOBAL PROPERTY STILLMAP_MODULE_LIBRARIES)
list(REMOVE_DUPLICATES module_libraries)
list(REMOVE_ITEM module_libraries nlohmann_json::nlohmann_json)  # headers only, in no public header
add_library(stillmap_library STATIC)
foreach(module IN LISTS modules)
  target_sources(stillmap_library PRIVATE $<TARGET_OBJECTS:${module}>)
endforeach()
target_compile_features(stillmap_library PUBLIC cxx_std_20)
target_include_directories(stillmap_library PUBLIC $<INSTALL_INTERFACE:include>)
target_link_libraries(stillmap_library PUBLIC Eigen3::Eigen opencv_core PRIVATE ${module_libraries})
# Programs that link the library find the plug-in in its folder.
target_link_options(stillmap_library INTERFACE
                    $<INSTALL_INTERFACE:LINKER:-rpath,$<INSTALL_PREFIX>/${plugin_folder}>)
set_target_properties(stillmap_library PROPERTIES OUTPUT_NAME stillmap EXPORT_NAME stillmap LINKER_LANGUAGE CXX)
install(TARGETS stillmap_library EXPORT StillmapTargets)
install(EXPORT StillmapTargets NAMESPACE Stillmap:: DESTINATION ${package_folder})
foreach(header IN LISTS STILLMAP_PUBLIC_HEADERS)
  cmake_path(GET header PARENT_PATH header_folder)
  install(FILES "${PROJECT_SOURCE_DIR}/stillmap/${header}" DESTINATION include/stillmap/${header_folder})
endforeach()

configure_package_config_file(cmake/StillmapConfig.cmake.in StillmapConfig.cmake
                              INSTALL_DESTINATION ${package_folder})
write_basic_package_version_file(StillmapConfigVersion.cmake COMPATIBILITY SameMinorVersion)
install(FILES "${PROJECT_BINARY_DIR}/StillmapConfig.cmake"
              "${PROJECT_BINARY_DIR}/StillmapConfigVersion.cmake"
        DESTINATION ${package_folder})

add_custom_target(stillmap_installed DEPENDS stillmap stillmap_library stillmap_manual)

# Installs into a fresh folder and uses the result with source and build folders hidden. Not with sanitizers:
# the other project of that test would have to be built with them too.
if(STILLMAP_BUILD_TESTS AND NOT STILLMAP_SANITIZE)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  add_test(NAME install
           COMMAND "${Python3_EXECUTABLE}" "${PROJECT_SOURCE_DIR}/cmake/installed_package_test/install_test.py"
                   --source "${PROJECT_SOURCE_DIR}" --build "${PROJECT_BINARY_DIR}" --cmake "${CMAKE_COMMAND}"
                   --build-type "${CMAKE_BUILD_TYPE}" --version "${PROJECT_VERSION}"
                   --libdir "${CMAKE_INSTALL_LIBDIR}" --openvino "$<TARGET_EXISTS:stillmap_openvino>"
                   --headers "${STILLMAP_PUBLIC_HEADERS}")
endif()
