# Read by cpack before it asks dpkg-shlibdeps for the packages of shared libraries: those of Open MPI, which the program loads
# under mpirun alone, are none to depend on.
file(WRITE ${CPACK_TEMPORARY_DIRECTORY}/debian/shlibs.local "libmpi 40\nlibmpi_cxx 40\n")
