// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/paint_tools.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace stillmap::simulate::paint {
namespace {

void poster_circles(cv::Mat& image, Random& random) {
  const cv::Point center(image.cols / 2, image.rows * 2 / 5);
  for (int r = image.cols * 2 / 5; r > 8; r -= random.integer(9, 18)) {
    disc(image, center + cv::Point(random.integer(-6, 6), random.integer(-6, 6)), r, vivid(random));
  }
}

void poster_triangles(cv::Mat& image, Random& random) {
  for (int row = 0; row < 8; ++row) {
    for (int column = 0; column < 6; ++column) {
      const int s = image.cols / 6;
      const cv::Point p(column * s, row * s);
      const cv::Point a = p, b = p + cv::Point(s, 0), c = p + cv::Point(s, s),
                      d = p + cv::Point(0, s);
      const bool flip = random.chance(0.5);
      polygon(image, flip ? std::vector{a, b, c} : std::vector{a, b, d}, vivid(random));
      polygon(image, flip ? std::vector{a, c, d} : std::vector{b, c, d}, vivid(random));
    }
  }
}

void poster_mountains(cv::Mat& image, Random& random) {
  for (int y = 0; y < image.rows; ++y) {
    const double s = static_cast<double>(y) / image.rows;
    line(image, {0, y}, {image.cols, y}, cv::Scalar(200 - 120 * s, 150 + 40 * s, 120 + 130 * s));
  }
  disc(image, {image.cols * 2 / 3, image.rows / 4}, image.cols / 8, {150, 220, 250});
  for (int layer = 0; layer < 5; ++layer) {
    std::vector<cv::Point> ridge{{0, image.rows}};
    const int base = image.rows * (4 + layer) / 11;
    for (int x = 0; x <= image.cols; x += 16) {
      ridge.emplace_back(x, base + random.integer(-34, 34));
    }
    ridge.emplace_back(image.cols, image.rows);
    polygon(image, ridge, cv::Scalar(130 - 22 * layer, 105 - 17 * layer, 80 - 10 * layer));
  }
}

void poster_blocks(cv::Mat& image, Random& random) {
  for (int i = 0; i < 26; ++i) {
    const cv::Rect block(random.integer(0, image.cols - 60), random.integer(0, image.rows - 130),
                         random.integer(24, 130), random.integer(24, 130));
    fill(image, block, vivid(random));
    cv::rectangle(image, block, kInk, 3);
  }
}

void poster_rays(cv::Mat& image, Random& random) {
  const cv::Point center(image.cols / 2, image.rows / 2);
  for (int i = 0; i < 32; i += 2) {
    const auto at = [&](int k) {
      return center + cv::Point(static_cast<int>(700 * std::cos(kTau * k / 32)),
                                static_cast<int>(700 * std::sin(kTau * k / 32)));
    };
    polygon(image, {center, at(i), at(i + 1)}, vivid(random));
  }
  disc(image, center, 76, kPaper);
  disc(image, center, 76, kInk, 6);
  write(image, title(random).substr(0, 4), center + cv::Point(-58, 16), 1.4, kInk, 4,
        cv::FONT_HERSHEY_DUPLEX);
}

void poster_diagram(cv::Mat& image, Random& random) {
  std::vector<cv::Point> nodes;
  for (int i = 0; i < 18; ++i) {
    nodes.emplace_back(random.integer(30, image.cols - 30), random.integer(40, image.rows - 150));
  }
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    line(image, nodes[i], random.pick(nodes), {120, 110, 90}, 2);
    line(image, nodes[i], nodes[(i + 1) % nodes.size()], {90, 60, 60}, 2);
  }
  for (const auto& node : nodes) {
    disc(image, node, random.integer(9, 22), vivid(random));
    write(image, word(random), node + cv::Point(12, -8), 0.42, kInk, 1);
  }
}

void draw_house_row(cv::Mat& image, int ground, Random& random) {
  for (int x = -20; x < image.cols;) {
    const int width = random.integer(34, 90), height = random.integer(70, 250);
    const cv::Rect house(x, ground - height, width, height + 300);
    const cv::Scalar wall(random.uniform(110, 190), random.uniform(120, 190),
                          random.uniform(130, 205));
    fill(image, house, wall);
    fill(image, {x, ground - height, width, 6}, shade(wall, 0.6));
    for (int y = house.y + 14; y < ground + 60; y += 20) {
      for (int w = x + 6; w + 9 < x + width; w += 15) {
        fill(image, {w, y, 8, 11},
             random.chance(0.3) ? cv::Scalar(190, 220, 235) : shade(wall, 0.4));
      }
    }
    x += width + random.integer(-2, 8);
  }
}

void tree(cv::Mat& image, cv::Point at, int size, Random& random) {
  line(image, at, at - cv::Point(0, size), {40, 60, 80}, 6);
  for (int i = 0; i < 60; ++i) {
    const cv::Point p = at + cv::Point(random.integer(-size / 2, size / 2),
                                       -size + random.integer(-size / 2, size / 3));
    disc(image, p, random.integer(4, 10),
         cv::Scalar(random.uniform(30, 70), random.uniform(80, 150), random.uniform(40, 90)));
  }
}

void screen_code(cv::Mat& image, Random& random) {
  const std::array colors{cv::Scalar(210, 160, 90), cv::Scalar(120, 210, 140),
                          cv::Scalar(230, 230, 230), cv::Scalar(110, 150, 235),
                          cv::Scalar(200, 140, 210)};
  fill(image, {0, 0, 512, 18}, {70, 62, 60});
  fill(image, {0, 18, 84, 300}, {48, 42, 40});
  for (int y = 32; y < 300; y += 12) {
    write(image, word(random), {6, y}, 0.33, {170, 165, 160});
    write(image, std::to_string(y / 12), {88, y}, 0.32, {120, 115, 110});
    int x = 112 + 14 * random.integer(0, 4);
    while (x < 430 && !random.chance(0.14)) {
      const std::string text = word(random) + (random.chance(0.3) ? "(" : "");
      write(image, text, {x, y}, 0.36, random.pick(colors), 1);
      x += static_cast<int>(text.size()) * 7 + 6;
    }
  }
}

void screen_page(cv::Mat& image, Random& random) {
  image.setTo(cv::Scalar(242, 243, 244));
  fill(image, {0, 0, 512, 34}, {150, 96, 50});
  write(image, title(random), {14, 24}, 0.7, {250, 250, 250}, 2);
  for (int column = 0; column < 3; ++column) {
    const int x = 14 + 166 * column;
    fill(image, {x, 46, 152, 84}, vivid(random));
    for (int i = 0; i < 7; ++i) {
      disc(image, {x + random.integer(14, 138), 58 + random.integer(0, 60)}, random.integer(5, 16),
           vivid(random));
    }
    write(image, title(random), {x, 152}, 0.5, kInk, 2);
    text_block(image, {x, 156, 150, 118}, 0.34, {90, 86, 84}, random);
  }
}

void screen_chart(cv::Mat& image, Random& random) {
  image.setTo(cv::Scalar(58, 48, 40));
  for (int panel = 0; panel < 4; ++panel) {
    const cv::Point o(14 + 250 * (panel % 2), 14 + 138 * (panel / 2));
    cv::rectangle(image, {o.x, o.y, 234, 124}, {120, 110, 100}, 1);
    write(image, word(random), o + cv::Point(6, 14), 0.4, {210, 210, 210});
    for (int i = 1; i < 6; ++i)
      line(image, o + cv::Point(0, 20 * i), o + cv::Point(234, 20 * i), {84, 74, 66});
    const cv::Scalar color = vivid(random);
    cv::Point last = o + cv::Point(4, 70);
    for (int x = 16; x < 230; x += 12) {
      const cv::Point next =
          o + cv::Point(x, std::clamp(last.y - o.y + random.integer(-22, 22), 24, 116));
      if (panel % 3 == 0) fill(image, {next.x - 4, next.y, 8, o.y + 122 - next.y}, color);
      line(image, last, next, shade(color, 1.4), 2);
      last = next;
    }
  }
}

}  // namespace

cv::Mat poster(int kind, Random& random) {
  cv::Mat image(512, 360, CV_8UC3, shade(vivid(random), 1.25));
  using Draw = void (*)(cv::Mat&, Random&);
  static constexpr std::array<Draw, 6> kDraw{poster_mountains, poster_circles, poster_triangles,
                                             poster_diagram,   poster_blocks,  poster_rays};
  kDraw[static_cast<std::size_t>(kind) % kDraw.size()](image, random);
  fill(image, {0, 420, 360, 92}, kPaper);
  write(image, title(random) + " " + title(random), {16, 456}, 0.95, kInk, 2,
        cv::FONT_HERSHEY_DUPLEX);
  text_block(image, {16, 462, 330, 42}, 0.4, {90, 90, 90}, random);
  frame(image, {36, 36, 38}, 8);
  return image;
}

cv::Mat painting(int kind, Random& random) {
  cv::Mat image(384, 512, CV_8UC3, cv::Scalar(190, 200, 210));
  if (kind == 0) {
    poster_mountains(image, random);
    for (int i = 0; i < 5; ++i)
      tree(image, {random.integer(30, 480), random.integer(330, 370)}, 70, random);
  } else if (kind == 1) {
    for (int i = 0; i < 340; ++i) {  // broad strokes
      const cv::Point a(random.integer(0, 511), random.integer(0, 383));
      line(image, a, a + cv::Point(random.integer(-50, 50), random.integer(-30, 30)), vivid(random),
           random.integer(3, 13));
    }
  } else {
    image.setTo(cv::Scalar(205, 180, 150));
    draw_house_row(image, 300, random);
  }
  frame(image, {40, 62, 92}, 22);
  frame(image, {90, 150, 190}, 6);
  return image;
}

cv::Mat world_map(Random& random) {
  cv::Mat image = tint(noise({1024, 512}, {8, 4}, 5, random), {205, 178, 130}, 0.08);
  const cv::Mat land = noise(image.size(), {5, 3}, 6, random);
  const cv::Mat tone = noise(image.size(), {10, 8}, 5, random);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const float height = land.at<float>(y, x) - 0.06F;
      if (height < 0) continue;
      const cv::Scalar c = height < 0.015F
                               ? cv::Scalar(70, 90, 100)
                               : shade({120, 190, 175}, 0.85 + 0.5 * tone.at<float>(y, x));
      image.at<cv::Vec3b>(y, x) = {static_cast<std::uint8_t>(c[0]), static_cast<std::uint8_t>(c[1]),
                                   static_cast<std::uint8_t>(c[2])};
    }
  }
  for (int x = 64; x < 1024; x += 64) line(image, {x, 0}, {x, 511}, {150, 140, 120});
  for (int y = 64; y < 512; y += 64) line(image, {0, y}, {1023, y}, {150, 140, 120});
  for (int i = 0; i < 70; ++i) {
    const cv::Point at(random.integer(20, 960), random.integer(20, 490));
    disc(image, at, 3, {40, 40, 170});
    write(image, word(random), at + cv::Point(5, -3), 0.4, kInk);
  }
  frame(image, {50, 60, 70}, 12);
  return image;
}

cv::Mat window_view(Random& random) {
  cv::Mat image(512, 768, CV_8UC3, cv::Scalar());  // smooth lines blend with what is there
  for (int y = 0; y < image.rows; ++y) {
    const double s = static_cast<double>(y) / 400;
    line(image, {0, y}, {image.cols, y}, cv::Scalar(250, 225 + 15 * s, 190 + 45 * s));
  }
  const cv::Mat clouds = noise(image.size(), {4, 5}, 6, random);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      const double c = std::clamp(2.5 * clouds.at<float>(y, x), 0.0, 1.0);
      auto& p = image.at<cv::Vec3b>(y, x);
      for (int k = 0; k < 3; ++k) p[k] = cv::saturate_cast<std::uint8_t>(p[k] + c * (250 - p[k]));
    }
  }
  draw_house_row(image, 380, random);
  for (int i = 0; i < 14; ++i)
    tree(image, {random.integer(0, 767), random.integer(450, 511)}, 60, random);
  return image;
}

cv::Mat screen(int kind, Random& random) {
  cv::Mat image(288, 512, CV_8UC3, cv::Scalar(38, 33, 32));
  switch (kind % 4) {
    case 0:
      screen_code(image, random);
      break;
    case 1:
      screen_page(image, random);
      break;
    case 2:
      screen_chart(image, random);
      break;
    default:
      poster_mountains(image, random);
      draw_house_row(image, 190, random);
  }
  fill(image, {0, 276, 512, 12}, {60, 54, 50});
  for (int i = 0; i < 9; ++i) fill(image, {4 + 14 * i, 278, 9, 8}, vivid(random));
  return image;
}

}  // namespace stillmap::simulate::paint
