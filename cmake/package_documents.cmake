# CPack calls this on the staged files of each Debian package: replaces the license by the files that Debian's policy
# demands below /usr/share/doc, and gives the folders the right modes.
file(STRINGS "${CMAKE_CURRENT_LIST_DIR}/../CHANGELOG.md" released REGEX "^## \\[[0-9]" LIMIT_COUNT 1)
string(REGEX MATCH "[0-9-]+$" day "${released}")
execute_process(COMMAND date --utc --rfc-email --date "${day} 12:00" OUTPUT_VARIABLE date OUTPUT_STRIP_TRAILING_WHITESPACE
                COMMAND_ERROR_IS_FATAL ANY)
file(GLOB components "${CPACK_TEMPORARY_INSTALL_DIRECTORY}/*")
foreach(component IN LISTS components)
  cmake_path(GET component FILENAME name)
  string(TOUPPER "${name}" upper)
  set(package "${CPACK_DEBIAN_${upper}_PACKAGE_NAME}")
  set(documents "${component}/usr/share/doc/${package}")
  file(REMOVE "${documents}/LICENSE")
  file(MAKE_DIRECTORY "${documents}")
  file(COPY "${CMAKE_CURRENT_LIST_DIR}/debian/copyright" DESTINATION "${documents}")
  file(COPY_FILE "${CMAKE_CURRENT_LIST_DIR}/../CHANGELOG.md" "${documents}/changelog")
  execute_process(COMMAND gzip -9n "${documents}/changelog" COMMAND_ERROR_IS_FATAL ANY)
  file(WRITE "${documents}/changelog.Debian" "stillmap (${CPACK_PACKAGE_VERSION}-${CPACK_DEBIAN_PACKAGE_RELEASE}) \
unstable; urgency=medium\n\n  * New release, see changelog.gz.\n\n -- ${CPACK_PACKAGE_CONTACT}  ${date}\n")
  execute_process(COMMAND gzip -9n "${documents}/changelog.Debian" COMMAND_ERROR_IS_FATAL ANY)
  if(EXISTS "${CMAKE_CURRENT_LIST_DIR}/debian/${package}.lintian-overrides")
    file(MAKE_DIRECTORY "${component}/usr/share/lintian/overrides")
    file(COPY_FILE "${CMAKE_CURRENT_LIST_DIR}/debian/${package}.lintian-overrides"
         "${component}/usr/share/lintian/overrides/${package}")
  endif()
endforeach()
