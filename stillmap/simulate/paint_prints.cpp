// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/paint.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace stillmap::simulate::paint {
namespace {

constexpr double kTau = 2 * std::numbers::pi;
const cv::Scalar kInk(45, 42, 40), kPaper(228, 234, 236);

void fill(cv::Mat& image, cv::Rect area, const cv::Scalar& color) {
  cv::rectangle(image, area, color, cv::FILLED);
}
void line(cv::Mat& image, cv::Point a, cv::Point b, const cv::Scalar& color, int thickness = 1) {
  cv::line(image, a, b, color, thickness, cv::LINE_AA);
}
void disc(cv::Mat& image, cv::Point at, int radius, const cv::Scalar& color,
          int thickness = cv::FILLED) {
  cv::circle(image, at, radius, color, thickness, cv::LINE_AA);
}
void write(cv::Mat& image, const std::string& text, cv::Point at, double size,
           const cv::Scalar& color, int thickness = 1, int font = cv::FONT_HERSHEY_SIMPLEX) {
  cv::putText(image, text, at, font, size, color, thickness, cv::LINE_AA);
}
void polygon(cv::Mat& image, const std::vector<cv::Point>& points, const cv::Scalar& color) {
  cv::fillPoly(image, std::vector<std::vector<cv::Point>>{points}, color, cv::LINE_AA);
}

std::string word(Random& random) {
  static constexpr std::array kSyllables{"ka", "lo",  "mi", "ter", "ra", "sen", "vo", "du",
                                         "ne", "bar", "is", "on",  "pe", "qui", "fa", "th"};
  std::string text;
  for (int i = random.integer(1, 4); i > 0; --i) text += random.pick(kSyllables);
  return text;
}

std::string title(Random& random) {
  std::string text = word(random);
  std::transform(text.begin(), text.end(), text.begin(),
                 [](unsigned char c) { return std::toupper(c); });
  return text;
}

/// Lines of small words inside `area`.
void text_block(cv::Mat& image, cv::Rect area, double size, const cv::Scalar& color,
                Random& random) {
  const int leading = static_cast<int>(34 * size);
  for (int y = area.y + leading; y <= area.br().y; y += leading) {
    std::string text;
    while (static_cast<double>(text.size()) * 18 * size < area.width * 0.8)
      text += word(random) + " ";
    if (random.chance(0.2)) text.resize(text.size() / 2);
    write(image, text, {area.x, y}, size, color, 1);
  }
}

void frame(cv::Mat& image, const cv::Scalar& color, int width) {
  cv::rectangle(image, {width / 2, width / 2, image.cols - width, image.rows - width}, color,
                width);
}

void poster_circles(cv::Mat& image, Random& random) {
  const cv::Point centre(image.cols / 2, image.rows * 2 / 5);
  for (int r = image.cols * 2 / 5; r > 8; r -= random.integer(9, 18)) {
    disc(image, centre + cv::Point(random.integer(-6, 6), random.integer(-6, 6)), r, vivid(random));
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
  const cv::Point centre(image.cols / 2, image.rows / 2);
  for (int i = 0; i < 32; i += 2) {
    const auto at = [&](int k) {
      return centre + cv::Point(static_cast<int>(700 * std::cos(kTau * k / 32)),
                                static_cast<int>(700 * std::sin(kTau * k / 32)));
    };
    polygon(image, {centre, at(i), at(i + 1)}, vivid(random));
  }
  disc(image, centre, 76, kPaper);
  disc(image, centre, 76, kInk, 6);
  write(image, title(random).substr(0, 4), centre + cv::Point(-58, 16), 1.4, kInk, 4,
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

cv::Mat rug(Random& random) {
  cv::Mat image(768, 1024, CV_8UC3, cv::Scalar(56, 48, 120));
  const std::array colors{cv::Scalar(56, 48, 128), cv::Scalar(96, 66, 44),
                          cv::Scalar(150, 196, 214), cv::Scalar(70, 110, 160),
                          cv::Scalar(60, 84, 60)};
  int inset = 0;
  for (int band = 0; band < 6; ++band) {
    const int width = random.integer(16, 30);
    cv::rectangle(image, {inset, inset, 1024 - 2 * inset, 768 - 2 * inset},
                  colors[static_cast<std::size_t>(band) % colors.size()], cv::FILLED);
    for (int x = inset + 12; band % 2 == 0 && x < 1024 - inset; x += 24) {
      for (const int y : {inset + width / 2, 768 - inset - width / 2}) {
        polygon(image, {{x, y - 9}, {x + 9, y}, {x, y + 9}, {x - 9, y}}, colors[2]);
      }
    }
    inset += width;
  }
  for (int row = 0; row < 7; ++row) {
    for (int column = 0; column < 9; ++column) {
      const cv::Point c(180 + 83 * column, 168 + 72 * row);
      for (int s = 34; s > 4; s -= 9) {
        polygon(
            image,
            {c - cv::Point(0, s), c + cv::Point(s, 0), c + cv::Point(0, s), c - cv::Point(s, 0)},
            random.pick(colors));
      }
    }
  }
  const cv::Mat field = noise(image.size(), {128, 96}, 3, random);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      auto& p = image.at<cv::Vec3b>(y, x);
      const double f = 1 + 0.35 * field.at<float>(y, x) + (y % 3 == 0 ? -0.08 : 0);
      for (int c = 0; c < 3; ++c) p[c] = cv::saturate_cast<std::uint8_t>(p[c] * f);
    }
  }
  return image;
}

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

cv::Mat whiteboard(Random& random) {
  cv::Mat image = tint(noise({1024, 512}, {6, 4}, 6, random), {232, 232, 230}, 0.03);
  const std::array pens{cv::Scalar(160, 60, 30), cv::Scalar(40, 40, 190), cv::Scalar(60, 120, 30),
                        kInk};
  for (int i = 0; i < 9; ++i) {
    const cv::Rect box(40 + 320 * (i % 3) + random.integer(-20, 30), 40 + 150 * (i / 3),
                       random.integer(110, 190), random.integer(50, 90));
    const cv::Scalar pen = random.pick(pens);
    if (i % 2 == 0)
      cv::rectangle(image, box, pen, 3, cv::LINE_AA);
    else
      cv::ellipse(image, (box.tl() + box.br()) / 2, box.size() / 2, 0, 0, 360, pen, 3, cv::LINE_AA);
    write(image, word(random), box.tl() + cv::Point(12, 34), 0.8, pen, 2,
          cv::FONT_HERSHEY_SCRIPT_SIMPLEX);
    write(image, word(random) + "=" + word(random), box.tl() + cv::Point(8, 60), 0.6,
          random.pick(pens), 2, cv::FONT_HERSHEY_SCRIPT_SIMPLEX);
    cv::arrowedLine(image, box.br(),
                    box.br() + cv::Point(random.integer(40, 110), random.integer(-60, 60)), pen, 3,
                    cv::LINE_AA, 0, 0.15);
  }
  frame(image, {140, 140, 138}, 16);
  return image;
}

cv::Mat pin_board(Random& random) {
  cv::Mat image = tint(noise({768, 512}, {96, 64}, 3, random), {92, 140, 184}, 0.35);
  for (int i = 0; i < 24; ++i) {
    const cv::Rect note(24 + 120 * (i % 6) + random.integer(-16, 16),
                        20 + 118 * (i / 6) + random.integer(-12, 12), random.integer(70, 112),
                        random.integer(64, 104));
    fill(image, note + cv::Point(4, 4), {50, 80, 110});
    const cv::Scalar color = random.chance(0.5) ? kPaper : shade(vivid(random), 1.3);
    fill(image, note & cv::Rect(0, 0, 768, 512), color);
    text_block(image, {note.x + 6, note.y + 6, note.width - 12, note.height - 14}, 0.4, kInk,
               random);
    disc(image, note.tl() + cv::Point(note.width / 2, 5), 5, vivid(random));
  }
  frame(image, {60, 96, 130}, 18);
  return image;
}

cv::Mat window_view(Random& random) {
  cv::Mat image(512, 768, CV_8UC3);
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

cv::Mat keyboard(Random& random) {
  cv::Mat image(160, 512, CV_8UC3, cv::Scalar(44, 44, 46));
  for (int row = 0; row < 6; ++row) {
    for (int x = 8 + 4 * row; x < 490;) {
      const int width = row == 5 && x > 100 && x < 240 ? 150 : random.integer(0, 9) == 0 ? 36 : 24;
      const cv::Rect key(x, 8 + 25 * row, std::min(width, 504 - x), 21);
      fill(image, key, {74, 72, 70});
      fill(image, {key.x, key.y, key.width, 3}, {104, 102, 100});
      write(image, std::string(1, static_cast<char>('A' + random.integer(0, 25))),
            key.tl() + cv::Point(6, 16), 0.42, {225, 225, 225});
      x += width + 4;
    }
  }
  return image;
}

cv::Mat paper(Random& random) {
  cv::Mat image(362, 256, CV_8UC3, kPaper);
  write(image, title(random), {22, 40}, 0.8, kInk, 2);
  text_block(image, {22, 48, 212, 110}, 0.42, {70, 70, 70}, random);
  fill(image, {22, 176, 100, 70}, shade(vivid(random), 1.1));
  text_block(image, {132, 168, 104, 82}, 0.4, {70, 70, 70}, random);
  text_block(image, {22, 256, 212, 84}, 0.42, {70, 70, 70}, random);
  return image;
}

cv::Mat book_spines(int columns, int rows, Random& random) {
  cv::Mat image(1024, 1024, CV_8UC3);
  const int width = 1024 / columns, height = 1024 / rows;
  for (int i = 0; i < columns * rows; ++i) {
    cv::Mat tall(width, height, CV_8UC3, muted(random));  // painted lying, then stood up
    const cv::Scalar base = muted(random);
    const cv::Scalar ink = base[1] > 140 ? kInk : cv::Scalar(210, 230, 235);
    tall.setTo(base);
    for (const int x : {random.integer(6, 26), height - random.integer(8, 30)}) {
      fill(tall, {x, 0, random.integer(3, 10), width}, random.chance(0.5) ? ink : muted(random));
    }
    const int style = random.integer(0, 3);
    if (style == 0) fill(tall, {height / 3, 0, height / 3, width}, muted(random));
    write(tall, title(random), {40, width * 2 / 3}, width / 46.0, ink, 2, cv::FONT_HERSHEY_DUPLEX);
    disc(tall, {height - 44, width / 2}, width / 5, ink, style == 1 ? 2 : cv::FILLED);
    cv::rectangle(tall, {0, 0, height, width}, shade(base, 0.5), 2);
    cv::Mat upright;
    cv::rotate(tall, upright, cv::ROTATE_90_CLOCKWISE);
    upright.copyTo(image({width * (i % columns), height * (i / columns), width, height}));
  }
  return image;
}

cv::Mat book_cover(Random& random) {
  cv::Mat image = poster(random.integer(0, 5), random);
  cv::Mat small;
  cv::resize(image, small, {180, 256}, 0, 0, cv::INTER_AREA);
  return small;
}

cv::Mat clock_face() {
  cv::Mat image(256, 256, CV_8UC3, cv::Scalar(235, 236, 236));
  disc(image, {128, 128}, 122, {50, 50, 52}, 10);
  for (int i = 0; i < 60; ++i) {
    const double a = kTau * i / 60;
    const auto at = [&](double r) {
      return cv::Point(static_cast<int>(128 + r * std::sin(a)),
                       static_cast<int>(128 - r * std::cos(a)));
    };
    line(image, at(i % 5 == 0 ? 94 : 104), at(112), kInk, i % 5 == 0 ? 5 : 2);
  }
  line(image, {128, 128}, {72, 96}, kInk, 8);
  line(image, {128, 128}, {150, 40}, kInk, 5);
  disc(image, {128, 128}, 9, {40, 40, 180});
  return image;
}

cv::Mat mug(Random& random) {
  cv::Mat image(128, 256, CV_8UC3, random.chance(0.5) ? cv::Scalar(225, 228, 230) : vivid(random));
  for (int i = 0; i < 14; ++i)
    disc(image, {random.integer(0, 255), random.integer(20, 108)}, random.integer(5, 14),
         vivid(random));
  write(image, title(random), {20, 76}, 1.1, kInk, 3);
  write(image, title(random), {140, 76}, 1.1, kInk, 3);
  return image;
}

cv::Mat door(Random& random) {
  cv::Mat image = wood({84, 122, 156}, random);
  cv::rotate(image, image, cv::ROTATE_90_CLOCKWISE);
  for (const int y : {30, 280}) {
    for (const int x : {50, 280}) {
      cv::rectangle(image, {x, y, 182, 200}, {50, 78, 104}, 8);
      cv::rectangle(image, {x + 10, y + 10, 162, 180}, {110, 150, 182}, 3);
    }
  }
  fill(image, {190, 70, 130, 74}, {225, 228, 228});
  write(image, "ROOM 214", {198, 102}, 0.75, kInk, 2);
  text_block(image, {198, 106, 110, 32}, 0.4, {90, 90, 90}, random);
  disc(image, {470, 262}, 14, {170, 190, 196});
  return image;
}

cv::Mat drawers(const cv::Scalar& base, int count, Random& random) {
  cv::Mat image = tint(noise({512, 512}, {6, 6}, 7, random), base, 0.1);
  const int height = 512 / count;
  for (int i = 0; i < count; ++i) {
    const cv::Rect front(8, i * height + 6, 496, height - 12);
    cv::rectangle(image, front, shade(base, 0.45), 5);
    fill(image, {206, front.y + front.height / 3, 100, 14}, {70, 72, 74});
    fill(image, {206, front.y + front.height / 3, 100, 4}, {170, 172, 174});
    fill(image, {216, front.y + front.height / 3 + 26, 80, 26}, kPaper);
    write(image, word(random), {220, front.y + front.height / 3 + 45}, 0.5, kInk, 1);
    if (random.chance(0.6)) {  // a sticker
      const cv::Point at(random.integer(50, 160), front.y + front.height / 2);
      disc(image, at, 22, vivid(random));
      disc(image, at, 12, vivid(random));
    }
  }
  return image;
}

cv::Mat radiator(Random& random) {
  cv::Mat image = tint(noise({512, 128}, {6, 4}, 6, random), {222, 224, 225}, 0.05);
  for (int x = 4; x < 512; x += 24) {
    fill(image, {x, 8, 7, 112}, {130, 132, 134});
    fill(image, {x + 7, 8, 3, 112}, {245, 245, 245});
  }
  return image;
}

cv::Mat ball(Random& random) {
  cv::Mat image(256, 512, CV_8UC3, cv::Scalar(230, 232, 234));
  for (int row = 0; row < 4; ++row) {
    for (int column = 0; column < 8; ++column) {
      const cv::Scalar color = (row + column) % 2 == 0 ? vivid(random) : cv::Scalar(232, 234, 236);
      fill(image, {64 * column, 64 * row, 64, 64}, color);
      disc(image, {64 * column + 32, 64 * row + 32}, 16, vivid(random));
      disc(image, {64 * column + 32, 64 * row + 32}, 7, kInk);
    }
  }
  return image;
}

cv::Mat hazard_crate(Random& random) {
  cv::Mat image = wood({70, 130, 190}, random);
  for (int i = 0; i < 6; ++i) line(image, {0, 85 * i}, {511, 85 * i}, {30, 54, 80}, 5);
  for (int x = -100; x < 620; x += 70) {
    polygon(image, {{x, 0}, {x + 35, 0}, {x - 5, 60}, {x - 40, 60}}, {30, 30, 30});
    polygon(image, {{x + 35, 0}, {x + 70, 0}, {x + 30, 60}, {x - 5, 60}}, {20, 190, 240});
  }
  frame(image, {40, 70, 100}, 26);
  write(image, title(random), {60, 250}, 2.4, {240, 240, 240}, 7, cv::FONT_HERSHEY_DUPLEX);
  write(image, "50 KG", {80, 340}, 2, {30, 30, 30}, 5, cv::FONT_HERSHEY_DUPLEX);
  text_block(image, {60, 360, 380, 110}, 0.8, {20, 20, 30}, random);
  for (const int x : {36, 476}) {
    for (const int y : {36, 256, 476}) disc(image, {x, y}, 9, {160, 170, 175});
  }
  return image;
}

}  // namespace stillmap::simulate::paint
