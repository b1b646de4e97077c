// Checks that stb_image leaves out before it copies the bytes of a PNG.
#pragma once

#include <string>
#include <string_view>

namespace pilesim {

// False of a PNG whose first IDAT chunk is empty, or that has none: the decoder would copy from
// nowhere. True of pictures that are no PNG.
bool may_be_decoded(std::string_view picture);

// Why a PNG must not be decoded: not may_be_decoded(), or its compressed data hold more than its
// pixels, which the decoder would take in whole. Empty: nothing.
std::string png_fault(std::string_view picture);

}  // namespace pilesim
