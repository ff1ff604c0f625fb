#!/usr/bin/env bash
# build_openvdb.sh PREFIX: oneTBB and OpenVDB as static libraries, for wheels that need nothing beside them.
# Without delayed loading OpenVDB >= 12 needs no Boost; with its own half type it needs no Imath.
# TBB_SOURCE and OPENVDB_SOURCE name source trees to use instead of fetching them.
set -euo pipefail
prefix=$(mkdir -p "$1" && cd "$1" && pwd)
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT

source_of() { # NAME GIVEN URL TAG
    if [ -n "$2" ]; then
        echo "$2"
    else
        git clone --quiet --depth 1 --branch "$4" "$3" "$work/$1" && echo "$work/$1"
    fi
}

install() { # NAME SOURCE OPTION...
    local name=$1 source=$2
    shift 2
    cmake -S "$source" -B "$work/$name-build" -DCMAKE_BUILD_TYPE=Release -DCMAKE_INSTALL_PREFIX="$prefix" \
        -DCMAKE_PREFIX_PATH="$prefix" -DCMAKE_INSTALL_LIBDIR=lib -DCMAKE_POSITION_INDEPENDENT_CODE=ON \
        -DCMAKE_POLICY_DEFAULT_CMP0091=NEW -DCMAKE_MSVC_RUNTIME_LIBRARY=MultiThreadedDLL "$@"
    cmake --build "$work/$name-build" --config Release --parallel "${JOBS:-2}"
    cmake --install "$work/$name-build" --config Release
}

tbb=$(source_of tbb "${TBB_SOURCE:-}" https://github.com/uxlfoundation/oneTBB.git v2022.1.0)
install tbb "$tbb" -DBUILD_SHARED_LIBS=OFF -DTBB_TEST=OFF -DTBB_STRICT=OFF -DTBBMALLOC_BUILD=OFF

openvdb=$(source_of openvdb "${OPENVDB_SOURCE:-}" https://github.com/AcademySoftwareFoundation/openvdb.git v12.1.1)
install openvdb "$openvdb" -DOPENVDB_CORE_SHARED=OFF -DOPENVDB_CORE_STATIC=ON -DOPENVDB_BUILD_BINARIES=OFF \
    -DOPENVDB_USE_DELAYED_LOADING=OFF -DUSE_IMATH_HALF=OFF -DUSE_BLOSC=OFF -DUSE_ZLIB=OFF \
    -DUSE_EXPLICIT_INSTANTIATION=OFF -DUSE_CCACHE=OFF -DTBB_DIR="$prefix/lib/cmake/TBB"
