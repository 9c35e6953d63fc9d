# find_package(dynakin) -> dynakin::core. The suffixes find the headers of the cmeel-eigen package too.
include(CMakeFindDependencyMacro)
find_dependency(Eigen3 CONFIG PATH_SUFFIXES cmeel.prefix cmeel.prefix/share/eigen3/cmake)
find_dependency(Threads)
include(${CMAKE_CURRENT_LIST_DIR}/dynakinTargets.cmake)
