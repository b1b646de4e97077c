# cmake --install, and a Debian package by CPack (docs/install.md).
include(GNUInstallDirs)

# man and the shells ask the program itself what its options are.
set(reference ${PROJECT_BINARY_DIR}/reference)
file(MAKE_DIRECTORY ${reference})
foreach(form man bash zsh)
  set(file ${reference}/pilesim.${form})
  add_custom_command(OUTPUT ${file} COMMAND pilesim reference ${form} -o ${file} DEPENDS pilesim
                     VERBATIM)
  list(APPEND reference_files ${file})
endforeach()
add_custom_target(reference ALL DEPENDS ${reference_files})

install(TARGETS pilesim RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
install(FILES ${reference}/pilesim.man DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 RENAME pilesim.1)
install(FILES ${reference}/pilesim.bash DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
        RENAME pilesim)
install(FILES ${reference}/pilesim.zsh DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions
        RENAME _pilesim)
# Presets name their meshes by ../../assets/: the two stay side by side.
install(DIRECTORY presets DESTINATION ${CMAKE_INSTALL_DATADIR}/pilesim
        FILES_MATCHING PATTERN *.json PATTERN *.obj PATTERN *.mtl)
# They name presets/ and assets/ beside them.
install(DIRECTORY reproduce DESTINATION ${CMAKE_INSTALL_DATADIR}/pilesim FILES_MATCHING PATTERN *.json)
install(DIRECTORY assets DESTINATION ${CMAKE_INSTALL_DATADIR}/pilesim
        FILES_MATCHING PATTERN *.obj PATTERN generate EXCLUDE)
install(FILES ${PROJECT_BINARY_DIR}/import_pilesim.py DESTINATION ${CMAKE_INSTALL_DATADIR}/pilesim)
# The notices of what is built into the program, which a binary carries (docs/licences.md), as Debian has them.
set(notices "What pilesim is built of, and under which licences: docs/licences.md beside this file.\n")
foreach(package libeigen3-dev libcli11-dev nlohmann-json3-dev librandom123-dev libhwy-dev libstb-dev
        libimath-dev libtbb-dev libbullet-dev fonts-dejavu-core)
  if(EXISTS /usr/share/doc/${package}/copyright)
    file(READ /usr/share/doc/${package}/copyright notice)
    string(APPEND notices "\n\n======== ${package} ========\n\n${notice}")
  else()
    message(WARNING "The notice of ${package} is missing: packages may not be given away without it")
  endif()
endforeach()
file(WRITE ${PROJECT_BINARY_DIR}/copyright "${notices}")
install(FILES ${PROJECT_BINARY_DIR}/copyright DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES python/pilesim.py python/pilesim_batch.py python/example.py python/README.md DESTINATION ${CMAKE_INSTALL_DATADIR}/pilesim/python)
install(FILES README.md ARCHITECTURE.md CONTRIBUTING.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR}
        FILES_MATCHING PATTERN *.md PATTERN *.jpg PATTERN *.mp4)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME pilesim)
set(CPACK_PACKAGE_CONTACT "pilesim <pilesim@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "simulates and draws large piles of rigid objects")
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)  # the libraries, by what the program is linked with
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "ffmpeg, gnuplot-nox")  # videos; charts
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
include(CPack)
