# C programs with CMake:
#
#   find_package(ftMscLib REQUIRED COMPONENTS txt)
#   target_link_libraries(program ftMscLib::txt)
#
# with -DftMscLib_DIR=FOLDER/c/cmake, where FOLDER is the folder of this repository. The components are the kinds of
# programs: robo_tx (downloaded to the ROBO TX), pc (with ftMscLib), txt (downloaded to the TXT), kit (4.1.6), kit466
# (4.6.6) and fttxtlib. The library is looked for where cargo makes it, or in ftMscLib_LIBRARY_DIR.

get_filename_component(_ftMscLib_C "${CMAKE_CURRENT_LIST_DIR}/.." ABSOLUTE)

if(NOT ftMscLib_LIBRARY_DIR)
    get_filename_component(ftMscLib_LIBRARY_DIR "${_ftMscLib_C}/../target/release" ABSOLUTE)
endif()
if(WIN32)
    set(_ftMscLib_NAME ftMscLib.dll)
else()
    set(_ftMscLib_NAME "libftMscLib${CMAKE_SHARED_LIBRARY_SUFFIX}")
endif()
set(_ftMscLib_LIBRARY "${ftMscLib_LIBRARY_DIR}/${_ftMscLib_NAME}")

# Adds a kind with the folders of its headers.
function(_ftMscLib_kind kind)
    set(folders ${ARGN})
    list(TRANSFORM folders PREPEND "${_ftMscLib_C}/")
    if(NOT WIN32)
        list(APPEND folders "${_ftMscLib_C}/include/posix")
    endif()
    add_library(ftMscLib::${kind} INTERFACE IMPORTED)
    set_target_properties(ftMscLib::${kind} PROPERTIES
        INTERFACE_INCLUDE_DIRECTORIES "${folders}"
        INTERFACE_LINK_LIBRARIES ftMscLib::library
        # As a folder of the system it would come behind those of the program, which may have old copies.
        IMPORTED_NO_SYSTEM TRUE)
    # These are looked into before any folder of the program, but for those of the including files.
    foreach(folder IN LISTS folders)
        set_property(TARGET ftMscLib::${kind} APPEND PROPERTY INTERFACE_COMPILE_OPTIONS "SHELL:-iquote \"${folder}\"")
    endforeach()
endfunction()

# Programs of the controllers: without a sign of char, and without optimization, because they wait in loops for
# fields that are not volatile.
set(_ftMscLib_OPTIONS -O0 -funsigned-char)

if(NOT EXISTS "${_ftMscLib_LIBRARY}")
    set(ftMscLib_FOUND FALSE)
    set(ftMscLib_NOT_FOUND_MESSAGE
        "${_ftMscLib_LIBRARY} is not there. Make it with cargo build --release --package ft-transfer-area-c, or name "
        "its folder in ftMscLib_LIBRARY_DIR.")
    string(CONCAT ftMscLib_NOT_FOUND_MESSAGE ${ftMscLib_NOT_FOUND_MESSAGE})
elseif(NOT TARGET ftMscLib::library)
    add_library(ftMscLib::library SHARED IMPORTED)
    set_target_properties(ftMscLib::library PROPERTIES
        IMPORTED_LOCATION "${_ftMscLib_LIBRARY}"
        IMPORTED_IMPLIB "${_ftMscLib_LIBRARY}"
        IMPORTED_NO_SONAME TRUE)
    _ftMscLib_kind(robo_tx include)
    set_target_properties(ftMscLib::robo_tx PROPERTIES INTERFACE_SOURCES "${_ftMscLib_C}/lib/tx_main.c")
    _ftMscLib_kind(pc include)
    _ftMscLib_kind(txt include/txt)
    _ftMscLib_kind(kit include/kit)
    _ftMscLib_kind(kit466 include/kit466 include/kit)
    _ftMscLib_kind(fttxtlib include/fttxtlib)
    foreach(kind IN ITEMS robo_tx txt)
        set_property(TARGET ftMscLib::${kind} APPEND PROPERTY INTERFACE_COMPILE_OPTIONS ${_ftMscLib_OPTIONS})
    endforeach()
    # No library calls a function of the program in place of the C library's of the same name, such as close.
    if(NOT WIN32)
        foreach(kind IN ITEMS robo_tx pc txt kit kit466 fttxtlib)
            set_property(TARGET ftMscLib::${kind} APPEND PROPERTY INTERFACE_COMPILE_OPTIONS -fvisibility=hidden)
        endforeach()
    endif()
    set_property(TARGET ftMscLib::kit466 APPEND PROPERTY INTERFACE_COMPILE_OPTIONS -O0)
endif()

foreach(kind IN LISTS ftMscLib_FIND_COMPONENTS)
    if(TARGET ftMscLib::${kind})
        set(ftMscLib_${kind}_FOUND TRUE)
    elseif(ftMscLib_FIND_REQUIRED_${kind} AND NOT ftMscLib_NOT_FOUND_MESSAGE)
        set(ftMscLib_FOUND FALSE)
        set(ftMscLib_NOT_FOUND_MESSAGE
            "There is no kind ${kind} of programs, only robo_tx, pc, txt, kit, kit466 and fttxtlib.")
    endif()
endforeach()
