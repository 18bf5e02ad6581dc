#!/bin/sh
# Installs the library, its header and its pkg-config file: install.sh PREFIX [FOLDER], where FOLDER has the built libraries
# (target/release of this project unless told).
set -eu
prefix=${1:?"usage: install.sh PREFIX [FOLDER]"}
here=$(cd "$(dirname "$0")" && pwd)
built=${2:-$here/../../target/release}
version=$(sed -n '/^\[workspace.package\]/,/^version/ s/^version = "\(.*\)"/\1/p' "$here/../../Cargo.toml")

mkdir -p "$prefix/lib/pkgconfig" "$prefix/include"
prefix=$(cd "$prefix" && pwd)
cp "$here/include/shsa.h" "$prefix/include/"
cp "$built/libshsa_c.a" "$prefix/lib/libshsa.a"
cp "$built/libshsa_c.so" "$prefix/lib/libshsa.so.$version"
# The name for the dynamic linker, which build.rs has written into the library, and the one for the linker.
ln -sf "libshsa.so.$version" "$prefix/lib/libshsa.so.${version%.*}"
ln -sf "libshsa.so.$version" "$prefix/lib/libshsa.so"
sed "s|@prefix@|$prefix|; s|@version@|$version|" "$here/shsa.pc.in" > "$prefix/lib/pkgconfig/shsa.pc"
