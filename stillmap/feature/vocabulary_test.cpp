// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/vocabulary.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/feature/vocabulary_training.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <set>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

Descriptor random_descriptor(std::mt19937_64& rng) { return {rng(), rng(), rng(), rng()}; }

/// Returns the descriptor with `bits` random bits flipped.
Descriptor disturbed(Descriptor d, int bits, std::mt19937_64& rng) {
  for (int i = 0; i < bits; ++i) {
    const std::uint64_t bit = rng() % 256;
    d[bit / 64] ^= std::uint64_t{1} << (bit % 64);
  }
  return d;
}

/// Images that each show some of 64 corners with slightly different descriptors.
struct Album {
  std::vector<Descriptor> corners;
  std::vector<std::vector<Descriptor>> images;
};

Album album(int bits = 6) {
  std::mt19937_64 rng(5);
  Album album;
  for (int i = 0; i < 64; ++i) album.corners.push_back(random_descriptor(rng));
  for (std::size_t image = 0; image < 40; ++image) {
    std::vector<Descriptor> seen;
    for (std::size_t i = 0; i < 20; ++i)
      seen.push_back(disturbed(album.corners[(image * 7 + i) % 64], bits, rng));
    album.images.push_back(seen);
  }
  return album;
}

/// Returns a vocabulary of two words, all zeros and all ones, with weights 1 and 3.
Vocabulary two_words() { return {{2, 0, 0}, {Descriptor{}, {~0ULL, ~0ULL, ~0ULL, ~0ULL}}, {1, 3}}; }

TEST(Vocabulary, ViewsOfOneCornerShareAWord) {
  const Album a = album();
  const Vocabulary vocabulary = train_vocabulary(a.images, {.branching = 8, .depth = 4});
  std::mt19937_64 rng(9);
  int same = 0;
  std::set<std::uint32_t> words;
  for (const Descriptor& corner : a.corners) {
    const auto word = vocabulary.node(corner, 2);  // 8^2 nodes for 64 corners
    words.insert(word);
    for (int i = 0; i < 10; ++i) same += vocabulary.node(disturbed(corner, 6, rng), 2) == word;
  }
  EXPECT_GE(same, 64 * 10 * 98 / 100);
  EXPECT_GE(words.size(), 40U) << "different corners mostly have different words";
}

TEST(Vocabulary, TrainingDependsOnImagesAndSeedOnly) {
  const Album a = album(40);
  const VocabularyTrainingOptions options{.branching = 4, .depth = 3};
  const std::string bytes = train_vocabulary(a.images, options).bytes();
  EXPECT_EQ(train_vocabulary(a.images, options).bytes(), bytes);
  VocabularyTrainingOptions other = options;
  other.seed = 2;
  EXPECT_NE(train_vocabulary(a.images, other).bytes(), bytes);
}

TEST(Vocabulary, WeighsWordsByTheirCountAndRarity) {
  const Vocabulary vocabulary = two_words();
  const Descriptor zeros{}, ones{~0ULL, ~0ULL, ~0ULL, ~1ULL};
  const BagOfWords bag = vocabulary.transform(std::vector<Descriptor>{ones, zeros, zeros, zeros});
  // 3 x 1 against 1 x 3.
  EXPECT_EQ(bag.words, (BowVector{{0, 0.5F}, {1, 0.5F}}));
}

TEST(Vocabulary, RarityIsTheLogarithmOfImagesPerImageWithTheWord) {
  const Descriptor zeros{}, ones{~0ULL, ~0ULL, ~0ULL, ~0ULL};
  const std::vector<std::vector<Descriptor>> images = {{zeros, zeros, ones}, {zeros}, {zeros}};
  const Vocabulary vocabulary = train_vocabulary(images, {.branching = 2, .depth = 1});
  EXPECT_FLOAT_EQ(vocabulary.idf(vocabulary.word(zeros)), 0);
  EXPECT_FLOAT_EQ(vocabulary.idf(vocabulary.word(ones)), std::log(3.0F));
}

TEST(Vocabulary, DescriptorsWithoutWeightAreIgnored) {
  const Descriptor zeros{}, ones{~0ULL, ~0ULL, ~0ULL, ~0ULL};
  const std::vector<float> weights = {0, 0.2F, 0};
  const BagOfWords bag =
      two_words().transform(std::vector<Descriptor>{zeros, ones, zeros}, weights);
  EXPECT_EQ(bag.words, (BowVector{{1, 1.0F}}));
  EXPECT_EQ(bag.nodes, (std::vector<NodeKeypoint>{{2, 1}}));
  const std::vector<float> none = {0, 0, 0};
  EXPECT_TRUE(two_words().transform(std::vector<Descriptor>(3), none).words.empty());
}

TEST(Vocabulary, TheDirectIndexListsEachKeypointOnceByNode) {
  const Album a = album();
  const Vocabulary vocabulary = train_vocabulary(a.images, {.branching = 4, .depth = 3});
  const BagOfWords bag = vocabulary.transform(a.images[3], {}, 1);
  ASSERT_EQ(bag.nodes.size(), a.images[3].size());
  EXPECT_TRUE(std::is_sorted(bag.nodes.begin(), bag.nodes.end()));
  for (const auto& [node, keypoint] : bag.nodes)
    EXPECT_EQ(node, vocabulary.node(a.images[3][keypoint], 1));
}

TEST(Vocabulary, SimilarityIsOneForEqualAndZeroForDisjointImages) {
  const BowVector a = {{1, 0.25F}, {4, 0.75F}}, b = {{2, 0.5F}, {3, 0.5F}},
                  c = {{1, 0.5F}, {2, 0.5F}};
  EXPECT_DOUBLE_EQ(similarity(a, a), 1);
  EXPECT_DOUBLE_EQ(similarity(a, b), 0);
  EXPECT_DOUBLE_EQ(similarity(a, c), 0.25);  // 1 - (|.25 - .5| + .5 + .75) / 2
  EXPECT_DOUBLE_EQ(similarity(c, a), 0.25);
}

class VocabularyFile : public ::testing::Test {
 protected:
  static void expect_refused(const std::string& bytes, const std::string& reason) {
    try {
      Vocabulary::from_bytes(bytes, "some.bin");
      ADD_FAILURE() << "accepted";
    } catch (const Error& e) {
      EXPECT_NE(e.problem().find(reason), std::string::npos) << e.problem();
      EXPECT_EQ(e.where(), "some.bin");
    }
  }
  const std::string bytes_ = train_vocabulary(album().images, {.branching = 5, .depth = 3}).bytes();
};

TEST_F(VocabularyFile, RoundTrip) { EXPECT_EQ(Vocabulary::from_bytes(bytes_, "").bytes(), bytes_); }

TEST_F(VocabularyFile, InvalidFilesAreErrorsWithTheReason) {
  expect_refused("", "not a vocabulary");
  expect_refused("ORBvoc.txt: 10 6 0 0 and so on and so forth", "not a vocabulary");
  expect_refused(bytes_.substr(0, 27), "not a vocabulary");
  expect_refused(bytes_.substr(0, bytes_.size() - 1), "bytes");
  expect_refused(bytes_ + "x", "bytes");
  std::string newer = bytes_, altered = bytes_;
  newer[8] = 2;
  expect_refused(newer, "version 2");
  altered[bytes_.size() / 2] ^= 1;
  expect_refused(altered, "corrupt");
}

TEST(VocabularyParts, WithoutATreeAreAnError) {
  const std::vector<Descriptor> two(2);
  EXPECT_THROW(Vocabulary({1, 0, 0}, two, {1, 1}), Error) << "the last node has no parent";
  EXPECT_THROW(Vocabulary({3, 0, 0}, two, {1, 1}), Error) << "a child is missing";
  EXPECT_THROW(Vocabulary({0}, {}, {1}), Error);
  EXPECT_THROW(Vocabulary({2, 0, 0}, two, {1}), Error) << "a leaf without a weight";
  EXPECT_THROW(Vocabulary({2, 0, 0}, two, {1, NAN}), Error);
}

TEST(VocabularyTraining, RejectsDataThatCannotBeClustered) {
  const std::vector<std::vector<Descriptor>> equal(3, std::vector<Descriptor>(5));
  EXPECT_THROW(train_vocabulary(equal), Error);
  EXPECT_THROW(train_vocabulary({}), Error);
  EXPECT_THROW(train_vocabulary(album().images, {.branching = 1}), Error);
  EXPECT_THROW(train_vocabulary(album().images, {.depth = 0}), Error);
}

TEST(BuiltInVocabulary, HasEnoughWordsAndASmallFile) {
  const Vocabulary vocabulary = Vocabulary::built_in();
  EXPECT_GE(vocabulary.words(), 5000U);
  EXPECT_LE(vocabulary.bytes().size(), 4'000'000U);
}

/// In an office that is not in the training data, each image must be more similar to a nearby one
/// than to any image of another direction. The camera moves once around the room; images are 0.4 m
/// apart.
TEST(BuiltInVocabulary, NeighborsAreMoreSimilarThanOthers) {
  const Vocabulary vocabulary = Vocabulary::built_in();
  SimulatedSequence sequence({.people = 0,
                              .camera = "loop",
                              .frames = 24,
                              .fps = 1,
                              .width = 320,
                              .height = 240,
                              .seed = 1001});
  OrbExtractor orb({.keypoints = 500});
  std::vector<BowVector> bags;
  while (const auto frame = sequence.next())
    bags.push_back(vocabulary.transform(orb.extract(frame->gray).descriptors).words);
  int right = 0;
  for (std::size_t i = 1; i + 1 < bags.size(); ++i) {
    double near = 0, far = 0;
    for (std::size_t j = 0; j < bags.size(); ++j) {
      const std::size_t apart = i > j ? i - j : j - i;
      if (apart == 1) near = std::max(near, similarity(bags[i], bags[j]));
      if (apart > 4) far = std::max(far, similarity(bags[i], bags[j]));
    }
    right += near > far;
  }
  EXPECT_GE(right, 21) << "of 22";
}

}  // namespace
}  // namespace stillmap
