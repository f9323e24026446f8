# A package runs on other machines than this, from /usr.
if(CPACK_ISOCHRON_NATIVE OR NOT CPACK_ISOCHRON_PREFIX STREQUAL "/usr")
  message(FATAL_ERROR "a build for this machine alone makes no package: run scripts/package, which configures another")
endif()
