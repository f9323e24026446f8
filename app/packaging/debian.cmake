# The Debian package, made by scripts/package.
set(documents ${CMAKE_INSTALL_DATADIR}/doc/isochron)
install(FILES ${CMAKE_SOURCE_DIR}/LICENSE COMPONENT program DESTINATION ${documents} RENAME copyright)
set(ISOCHRON_MAINTAINER "isochron developers <isochron@example.org>" CACHE STRING
    "Maintainer of the Debian package: name <address>")
set(CPACK_PACKAGE_CONTACT "${ISOCHRON_MAINTAINER}")
string(TIMESTAMP changed "%a, %d %b %Y %H:%M:%S +0000" UTC)
configure_file(changelog.in changelog)
add_custom_command(OUTPUT changelog.gz COMMAND gzip -9nkf changelog DEPENDS changelog VERBATIM)
add_custom_target(changelog ALL DEPENDS changelog.gz)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/changelog.gz COMPONENT program DESTINATION ${documents})

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME isochron)
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_PROJECT_CONFIG_FILE ${CMAKE_CURRENT_SOURCE_DIR}/check_package.cmake)
set(CPACK_VERBATIM_VARIABLES ON)
set(CPACK_ISOCHRON_NATIVE ${ISOCHRON_NATIVE})
set(CPACK_ISOCHRON_PREFIX ${CMAKE_INSTALL_PREFIX})

set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_COMPRESSION_TYPE xz)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_DESCRIPTION "inverse rendering for time-of-flight imaging
Renders time-gated images with all orders of reflection, and their unbiased
derivatives by shapes, poses, materials and lights. Reconstructs scenes from
measured images and, around corners (non-line-of-sight imaging), from
histograms of photons that single-photon detectors count.
.
Holds the program, its Python package, and libraries and headers for C++.")
# Shared libraries by dpkg-shlibdeps; for Python what the package imports.
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS python3 python3-h5py python3-matplotlib python3-numpy python3-pil python3-scipy
    python3-yaml)
if(TARGET isochron_python)  # compiled for one version of Python
  set(Python3_EXECUTABLE /usr/bin/python3)
  find_package(Python3 REQUIRED COMPONENTS Interpreter)
  math(EXPR next "${Python3_VERSION_MINOR} + 1")
  list(APPEND CPACK_DEBIAN_PACKAGE_DEPENDS "python3 (>= 3.${Python3_VERSION_MINOR})" "python3 (<< 3.${next})")
endif()
# For mpirun, without which nothing of MPI is loaded, and what find_package(isochron) asks for.
set(CPACK_PRE_BUILD_SCRIPTS ${CMAKE_CURRENT_SOURCE_DIR}/without_mpi.cmake)
set(CPACK_DEBIAN_PACKAGE_SUGGESTS libopenmpi3 openmpi-bin
    cmake g++ libceres-dev libembree-dev libfmt-dev libhdf5-dev libopenexr-dev libopenmesh-dev libspdlog-dev libtbb-dev
    libyaml-cpp-dev)
list(JOIN CPACK_DEBIAN_PACKAGE_DEPENDS ", " CPACK_DEBIAN_PACKAGE_DEPENDS)
list(JOIN CPACK_DEBIAN_PACKAGE_SUGGESTS ", " CPACK_DEBIAN_PACKAGE_SUGGESTS)
set(CPACK_DEBIAN_PACKAGE_CONTROL_EXTRA ${CMAKE_CURRENT_SOURCE_DIR}/postinst ${CMAKE_CURRENT_SOURCE_DIR}/prerm)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
include(CPack)
