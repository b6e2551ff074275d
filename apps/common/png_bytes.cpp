// SPDX-License-Identifier: Apache-2.0
#include "png_bytes.hpp"

#include <string>

#include <png.h>

namespace sqmap::apps {

Result<std::vector<std::uint8_t>> png_bytes(std::span<const std::uint8_t> pixels, std::uint32_t width,
                                            std::uint32_t height, PixelFormat format) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = width;
  image.height = height;
  image.format = format == PixelFormat::kRgb ? PNG_FORMAT_RGB : PNG_FORMAT_RGBA;
  const auto refused = [&image] {
    return Error{Status::kFileUnwritable, std::string("libpng: ") + image.message, ""};
  };
  png_alloc_size_t size = 0;
  if (png_image_write_to_memory(&image, nullptr, &size, 0, pixels.data(), 0, nullptr) == 0) return refused();
  std::vector<std::uint8_t> bytes(size);
  if (png_image_write_to_memory(&image, bytes.data(), &size, 0, pixels.data(), 0, nullptr) == 0)
    return refused();
  bytes.resize(size);
  return bytes;
}

}  // namespace sqmap::apps
