// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/paint_tools.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace stillmap::simulate::paint {
namespace {

/// One octave of value noise, bilinear with smoothed weights (Perlin 1985), wrapped around.
void add_octave(cv::Mat& field, cv::Size cells, float amplitude, Random& random) {
  cv::Mat_<float> lattice(cells.height, cells.width + 1);
  for (int j = 0; j < cells.height; ++j) {
    for (int i = 0; i < cells.width; ++i) lattice(j, i) = amplitude * random.real(-1, 1);
    lattice(j, cells.width) = lattice(j, 0);
  }
  struct Step {
    int cell;
    float weight;
  };
  const auto steps = [](int pixels, int cell_count) {
    std::vector<Step> result;
    for (int i = 0; i < pixels; ++i) {
      const float s =
          static_cast<float>(i) * static_cast<float>(cell_count) / static_cast<float>(pixels);
      const float f = s - std::floor(s);
      result.push_back({static_cast<int>(s), f * f * (3 - 2 * f)});
    }
    return result;
  };
  const auto columns = steps(field.cols, cells.width), rows = steps(field.rows, cells.height);
  std::vector<float> line(static_cast<std::size_t>(cells.width) + 1);
  for (int y = 0; y < field.rows; ++y) {
    const Step& row = rows[static_cast<std::size_t>(y)];
    const float* a = lattice[row.cell];
    const float* b = lattice[(row.cell + 1) % cells.height];
    for (std::size_t i = 0; i < line.size(); ++i) line[i] = a[i] + row.weight * (b[i] - a[i]);
    auto* out = field.ptr<float>(y);
    for (std::size_t x = 0; x < columns.size(); ++x) {
      const float* left = line.data() + columns[x].cell;
      out[x] += left[0] + columns[x].weight * (left[1] - left[0]);
    }
  }
}

/// Multiplies an 8UC3 image by 1 + strength * field.
void modulate(cv::Mat& image, const cv::Mat& field, double strength) {
  for (int y = 0; y < image.rows; ++y) {
    auto* pixel = image.ptr<cv::Vec3b>(y);
    const auto* value = field.ptr<float>(y);
    for (int x = 0; x < image.cols; ++x) {
      const float factor = 1 + static_cast<float>(strength) * value[x];
      for (int c = 0; c < 3; ++c) {
        pixel[x][c] = cv::saturate_cast<std::uint8_t>(static_cast<float>(pixel[x][c]) * factor);
      }
    }
  }
}

/// Draws dots of random size, like the small marks of real surfaces.
void speckle(cv::Mat& image, int count, double low, double high, int radius, Random& random) {
  for (int i = 0; i < count; ++i) {
    const cv::Point at(random.integer(0, image.cols - 1), random.integer(0, image.rows - 1));
    const auto& c = image.at<cv::Vec3b>(at);
    const cv::Scalar color = shade(cv::Scalar(c[0], c[1], c[2]), random.uniform(low, high));
    cv::circle(image, at, random.integer(0, radius), color, cv::FILLED, cv::LINE_AA);
  }
}

/// Draws long, wavy wood grain along x.
cv::Mat grain(cv::Size size, Random& random) {
  cv::Mat field = noise(size, {2, size.height / 16}, 3, random);
  const cv::Mat bend = noise(size, {3, 2}, 2, random);
  for (int y = 0; y < size.height; ++y) {
    for (int x = 0; x < size.width; ++x) {
      const float rings = 14 * bend.at<float>(y, x) + 0.12F * static_cast<float>(y);
      field.at<float>(y, x) = 0.6F * field.at<float>(y, x) + 0.5F * std::sin(rings);
    }
  }
  return field;
}

}  // namespace

cv::Mat noise(cv::Size size, cv::Size cells, int octaves, Random& random) {
  cv::Mat field = cv::Mat::zeros(size, CV_32FC1);
  float amplitude = 0.6F;
  for (int i = 0; i < octaves; ++i, amplitude /= 2) {
    const cv::Size fine(std::min(cells.width << i, size.width),
                        std::min(std::max(1, cells.height) << i, size.height));
    add_octave(field, fine, amplitude, random);
  }
  return field;
}

cv::Mat tint(const cv::Mat& field, const cv::Scalar& base, double strength) {
  cv::Mat image(field.size(), CV_8UC3, base);
  modulate(image, field, strength);
  return image;
}

cv::Scalar shade(const cv::Scalar& color, double factor) {
  return {std::clamp(color[0] * factor, 0.0, 255.0), std::clamp(color[1] * factor, 0.0, 255.0),
          std::clamp(color[2] * factor, 0.0, 255.0)};
}

cv::Scalar vivid(Random& random) {
  const double hue = random.uniform(0, 6), low = random.uniform(40, 95),
               high = random.uniform(140, 228);
  const auto channel = [&](double shift) {
    const double d = std::abs(std::fmod(hue + shift, 6.0) - 3);
    return low + (high - low) * std::clamp(d - 1, 0.0, 1.0);
  };
  return {channel(2), channel(4), channel(0)};
}

cv::Scalar muted(Random& random) {
  static const std::vector<cv::Scalar> kDyes{
      {92, 58, 34},   {52, 38, 122},  {62, 88, 44},   {44, 44, 48},  {170, 206, 222},
      {40, 96, 176},  {120, 104, 52}, {84, 112, 150}, {38, 40, 84},  {206, 214, 216},
      {60, 150, 200}, {132, 92, 110}, {64, 72, 160},  {110, 130, 88}};
  return shade(random.pick(kDyes), random.uniform(0.8, 1.2));
}

cv::Mat planks(Random& random) {
  cv::Mat image(1024, 1024, CV_8UC3);
  constexpr int kRows = 16;
  const int height = image.rows / kRows;
  for (int row = 0; row < kRows; ++row) {
    int x = random.integer(-400, 0);
    while (x < image.cols) {
      const int length = random.integer(300, 700);
      const cv::Rect whole(x, row * height, length, height);
      const cv::Rect part = whole & cv::Rect(0, 0, image.cols, image.rows);
      if (part.width > 0) {
        const double tone = random.uniform(0.72, 1.12);
        const cv::Scalar base =
            shade({92, 138, 186}, tone) + cv::Scalar(random.uniform(-8, 8), 0, 0);
        tint(grain(part.size(), random), base, 0.2).copyTo(image(part));
        cv::rectangle(image, whole, shade(base, 0.45), 2);
      }
      x += length;
    }
  }
  speckle(image, 500, 0.5, 0.8, 2, random);
  return image;
}

cv::Mat wood(const cv::Scalar& base, Random& random) {
  cv::Mat image = tint(grain({512, 512}, random), base, 0.16);
  speckle(image, 250, 0.6, 0.85, 2, random);
  return image;
}

cv::Mat bricks(Random& random) {
  cv::Mat image = tint(noise({1024, 1024}, {16, 16}, 5, random), {150, 158, 162}, 0.2);
  constexpr int kRows = 20, kColumns = 6;
  const double width = 1024.0 / kColumns, height = 1024.0 / kRows;
  for (int row = 0; row < kRows; ++row) {
    for (int column = -1; column < kColumns; ++column) {
      const double x = (column + (row % 2 == 0 ? 0 : 0.5)) * width;
      const cv::Rect brick(static_cast<int>(x) + 4, static_cast<int>(row * height) + 4,
                           static_cast<int>(width) - 8, static_cast<int>(height) - 8);
      Random own(static_cast<std::uint64_t>(row * kColumns + (column + kColumns) % kColumns), 77);
      const cv::Scalar base =
          shade({66 + own.uniform(-8, 14), 88 + own.uniform(-8, 12), 150}, own.uniform(0.72, 1.15));
      cv::rectangle(image, brick, base, cv::FILLED);
      line(image, brick.tl(), {brick.br().x, brick.y}, shade(base, 1.25), 2);
      line(image, {brick.x, brick.br().y}, brick.br(), shade(base, 0.6), 2);
    }
  }
  modulate(image, noise(image.size(), {32, 32}, 5, random), 0.3);
  speckle(image, 2500, 0.55, 1.3, 3, random);
  return image;
}

cv::Mat plaster(const cv::Scalar& base, Random& random) {
  cv::Mat image = tint(noise({1024, 1024}, {6, 6}, 8, random), base, 0.09);
  speckle(image, 2600, 0.86, 1.1, 3, random);
  for (int i = 0; i < 40; ++i) {  // scuffs and roller marks
    const cv::Point a(random.integer(0, 1023), random.integer(0, 1023));
    line(image, a, a + cv::Point(random.integer(-30, 30), random.integer(-30, 30)),
         shade(base, random.uniform(0.85, 1.05)), random.integer(1, 2));
  }
  return image;
}

cv::Mat wallpaper(Random& random) {
  cv::Mat image = tint(noise({512, 512}, {8, 8}, 6, random), {168, 176, 160}, 0.06);
  const cv::Scalar dark(120, 132, 110), light(205, 214, 205);
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 8; ++column) {
      const cv::Point at(column * 64 + (row % 2) * 32, row * 64 + 16);
      for (int k = 0; k < 6; ++k) {
        cv::ellipse(image, at, {22, 7}, 60.0 * k + 15, 0, 360, k % 2 == 0 ? dark : light, 2,
                    cv::LINE_AA);
      }
      cv::circle(image, at, 5, dark, cv::FILLED, cv::LINE_AA);
    }
  }
  return image;
}

cv::Mat ceiling_tiles(Random& random) {
  cv::Mat image = tint(noise({512, 512}, {32, 32}, 4, random), {214, 218, 220}, 0.06);
  speckle(image, 2400, 0.55, 0.85, 2, random);
  for (int i = 0; i < 2; ++i) {
    cv::rectangle(image, {256 * i, 0, 5, 512}, {160, 162, 164}, cv::FILLED);
    cv::rectangle(image, {0, 256 * i, 512, 5}, {160, 162, 164}, cv::FILLED);
  }
  return image;
}

cv::Mat fabric(const cv::Scalar& base, Random& random) {
  const cv::Mat field = noise({256, 256}, {4, 4}, 7, random);
  cv::Mat image(256, 256, CV_8UC3);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const bool over = ((x / 8) + (y / 8)) % 2 == 0;  // a plain weave
      const double thread = over ? 0.88 + 0.04 * (y % 8) : 0.74 + 0.04 * (x % 8);
      const cv::Scalar c = shade(base, thread * (1 + 0.5 * field.at<float>(y, x)));
      image.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(c[0]), static_cast<std::uint8_t>(c[1]),
                                   static_cast<std::uint8_t>(c[2])};
    }
  }
  speckle(image, 160, 0.5, 1.6, 3, random);
  return image;
}

cv::Mat plain(const cv::Scalar& base, Random& random) {
  cv::Mat image = tint(noise({256, 256}, {4, 4}, 7, random), base, 0.12);
  speckle(image, 120, 0.6, 1.35, 2, random);
  for (int i = 0; i < 14; ++i) {
    const cv::Point a(random.integer(0, 255), random.integer(0, 255));
    line(image, a, a + cv::Point(random.integer(-25, 25), random.integer(-8, 8)),
         shade(base, 1.25));
  }
  return image;
}

cv::Mat steel(Random& random) {
  cv::Mat image = tint(noise({256, 256}, {2, 128}, 2, random), {158, 158, 156}, 0.08);
  speckle(image, 60, 0.6, 1.2, 2, random);
  return image;
}

cv::Mat cardboard(Random& random) {
  cv::Mat image = tint(noise({256, 256}, {6, 48}, 3, random), {98, 142, 178}, 0.12);
  cv::rectangle(image, {112, 0, 32, 256}, {120, 172, 205}, cv::FILLED);
  line(image, {128, 0}, {128, 255}, {60, 88, 110}, 1);
  const cv::Point at(random.integer(10, 30), random.integer(150, 170));
  cv::rectangle(image, {at.x, at.y, 84, 64}, {235, 238, 238}, cv::FILLED);
  for (int i = 0; i < 5; ++i) {
    line(image, at + cv::Point(6, 8 + 6 * i), at + cv::Point(random.integer(30, 76), 8 + 6 * i),
         {60, 60, 60}, 2);
  }
  for (int x = 6; x < 78; x += random.integer(3, 6)) {
    cv::rectangle(image, {at.x + x, at.y + 42, random.integer(1, 3), 18}, {20, 20, 20}, cv::FILLED);
  }
  cv::putText(image, "FRAGILE", {150, 60}, cv::FONT_HERSHEY_DUPLEX, 0.7, {40, 40, 190}, 2,
              cv::LINE_AA);
  cv::arrowedLine(image, {190, 130}, {190, 80}, {40, 40, 60}, 3, cv::LINE_AA, 0, 0.35);
  cv::arrowedLine(image, {215, 130}, {215, 80}, {40, 40, 60}, 3, cv::LINE_AA, 0, 0.35);
  line(image, {172, 140}, {234, 140}, {40, 40, 60}, 3);
  speckle(image, 60, 0.6, 0.85, 2, random);
  return image;
}

cv::Mat leaf(Random& random) {
  cv::Mat image = tint(noise({64, 128}, {4, 4}, 4, random), {56, 128, 62}, 0.3);
  line(image, {32, 0}, {32, 127}, {110, 190, 140}, 3);
  for (int y = 8; y < 128; y += 12) {
    line(image, {32, y}, {4, y - 10}, {90, 165, 110}, 1);
    line(image, {32, y}, {60, y - 10}, {90, 165, 110}, 1);
  }
  return image;
}

cv::Mat soil(Random& random) {
  cv::Mat image = tint(noise({128, 128}, {16, 16}, 4, random), {38, 52, 70}, 0.5);
  speckle(image, 150, 0.4, 2.2, 2, random);
  return image;
}

cv::Mat pot(Random& random) {
  const cv::Scalar base = vivid(random);
  cv::Mat image = tint(noise({512, 128}, {8, 4}, 5, random), base, 0.1);
  for (int x = 0; x < 512; x += 32) {
    line(image, {x, 50}, {x + 16, 78}, {230, 235, 235}, 4);
    line(image, {x + 16, 78}, {x + 32, 50}, {230, 235, 235}, 4);
  }
  cv::rectangle(image, {0, 0, 512, 12}, shade(base, 0.6), cv::FILLED);
  cv::rectangle(image, {0, 96, 512, 6}, shade(base, 0.5), cv::FILLED);
  return image;
}

}  // namespace stillmap::simulate::paint
