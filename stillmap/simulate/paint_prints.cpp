// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/paint_tools.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

namespace stillmap::simulate::paint {

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
