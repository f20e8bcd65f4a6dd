// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/renderer.hpp"

#include "stillmap/simulate/camera_motion.hpp"

#include <gtest/gtest.h>

namespace stillmap::simulate {
namespace {

constexpr int kWidth = 160, kHeight = 120;

Camera small_camera() {
  Camera camera;
  camera.width = kWidth;
  camera.height = kHeight;
  camera.fx = camera.fy = 130;
  camera.cx = (kWidth - 1) / 2.0;
  camera.cy = (kHeight - 1) / 2.0;
  return camera;
}

/// Returns a texture that is red on the left, blue on the right and green at the upper edge.
Textures flag() {
  cv::Mat image(64, 64, CV_8UC3, cv::Scalar(0, 0, 200));
  image.colRange(32, 64).setTo(cv::Scalar(200, 0, 0));
  image.rowRange(0, 12).setTo(cv::Scalar(0, 200, 0));
  return {Texture(image)};
}

void light_fully(Mesh& mesh) {
  for (Vertex& vertex : mesh.vertices) vertex.light.setOnes();
}

/// Returns a square of 2 m, upright in the plane y = 2, that faces the origin.
Mesh square(float grid = 0.3F) {
  MeshBuilder builder(grid);
  builder.quad(Transform::Identity(), {-1, 2, 1}, {2, 0, 0}, {0, 0, -2}, {});
  Mesh mesh = builder.take();
  light_fully(mesh);
  return mesh;
}

Rendering draw(const Mesh& mesh, const Pose& T_world_camera, int threads = 1) {
  const std::array<const Mesh*, 1> meshes{&mesh};
  return render(small_camera(), T_world_camera, meshes, flag(),
                {.color = true, .threads = threads});
}

TEST(Renderer, DepthOfAPlaneIsExact) {
  MeshBuilder builder(
      0.4F);  // A floor below, next to and behind the camera, clipped at its near plane.
  builder.quad(Transform::Identity(), {-8, 8, 0}, {16, 0, 0}, {0, -16, 0}, {});
  const Mesh floor = builder.take();
  const Camera camera = small_camera();
  const Pose T = look_at({0.3, -0.2, 1.4}, {1, 2, 0.1});
  const Rendering rendering = draw(floor, T);
  int seen = 0;
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Eigen::Vector3d ray = T.rotation() * camera.unproject(u, v, 1);
      const double expected = -T.translation().z() / ray.z();
      if (expected <= 0 || expected > 5) continue;
      ASSERT_NEAR(rendering.depth.at<float>(v, u), expected, 2e-6 * expected * expected)
          << u << ' ' << v;
      ++seen;
    }
  }
  EXPECT_GT(seen, kWidth * kHeight / 2);
}

TEST(Renderer, FacetsLeaveNoCracks) {
  const Rendering rendering = draw(square(0.03F), look_at({0.1, 1.5, 0.07}, {0.02, 2, 0}));
  EXPECT_EQ(cv::countNonZero(rendering.depth == 0), 0);
}

TEST(Renderer, TexturesAreOrientedCorrectly) {
  const Rendering rendering = draw(square(), look_at({0, 0, 0}, {0, 1, 0}));
  const auto color = [&](int u, int v) { return rendering.color.at<cv::Vec3f>(v, u); };
  EXPECT_GT(color(45, 80)[2], 190);             // left: red
  EXPECT_GT(color(115, 80)[0], 190);            // right: blue
  EXPECT_GT(color(60, 2)[1], 190);              // above: green
  EXPECT_EQ(color(2, 60), cv::Vec3f(0, 0, 0));  // Nothing next to the square.
}

TEST(Renderer, SurfacesAreVisibleFromTheFrontOnly) {
  const Rendering behind = draw(square(), look_at({0, 4, 0}, {0, 2, 0}));
  EXPECT_EQ(cv::countNonZero(behind.depth), 0);
}

TEST(Renderer, TheNearerInstanceIsVisible) {
  Mesh far = square(), near;
  append_transformed(square(), Transform(Eigen::Translation3f(0.9F, -0.6F, 0)), 7, near);
  light_fully(near);
  for (const bool near_first : {true, false}) {
    const std::array<const Mesh*, 2> meshes{near_first ? &near : &far, near_first ? &far : &near};
    const Rendering rendering =
        render(small_camera(), look_at({0, 0, 0}, {0, 1, 0}), meshes, flag());
    EXPECT_EQ(rendering.instances.at<std::uint8_t>(60, 100), 7);
    EXPECT_NEAR(rendering.depth.at<float>(60, 100), 1.4, 1e-5);
    EXPECT_EQ(rendering.instances.at<std::uint8_t>(60, 40), 0);
    EXPECT_NEAR(rendering.depth.at<float>(60, 40), 2.0, 1e-5);
  }
}

TEST(Renderer, EdgesAreAntialiased) {
  // The square's left edge is at u = cx - 65: a pixel on the edge is partly red and partly empty.
  const Rendering rendering = draw(square(), look_at({0.004, 0, 0}, {0.004, 1, 0}));
  bool mixed = false;
  for (int u = 0; u < 40; ++u) {
    const float red = rendering.color.at<cv::Vec3f>(80, u)[2];
    mixed = mixed || (red > 20 && red < 180);
  }
  EXPECT_TRUE(mixed);
}

TEST(Renderer, ThreadsDoNotChangeTheImage) {
  const Pose T = look_at({0.2, 0.9, 0.3}, {0.1, 2, -0.1});
  const Rendering one = draw(square(), T, 1), three = draw(square(), T, 3);
  EXPECT_EQ(cv::norm(one.color, three.color, cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(one.depth, three.depth, cv::NORM_INF), 0);
}

TEST(Lighting, OccludersDarkenNearbySurfaces) {
  MeshBuilder builder(0.1F);
  builder.quad(Transform::Identity(), {-2, 2, 0}, {4, 0, 0}, {0, -4, 0}, {});
  builder.occluder(place(0, 0, 0.3F), {0.5F, 0.5F, 0.6F});
  Mesh floor = builder.take();
  bake_light({{0.5F, 0.5F, 0.5F}, {}}, floor);
  float near_object = 0, away = 0;
  for (const Vertex& v : floor.vertices) {
    if ((v.position - Eigen::Vector3f(0.4F, 0, 0)).norm() < 0.06F) near_object = v.light.x();
    if ((v.position - Eigen::Vector3f(1.9F, 1.9F, 0)).norm() < 0.06F) away = v.light.x();
  }
  EXPECT_NEAR(away * away, 0.5, 1e-3);
  EXPECT_LT(near_object, 0.95F * away);
}

TEST(Lighting, LampsCastShadows) {
  MeshBuilder builder(0.1F);
  builder.quad(Transform::Identity(), {-2, 2, 0}, {4, 0, 0}, {0, -4, 0}, {});
  builder.occluder(place(0, 0, 1), {0.5F, 0.5F, 0.1F});
  Mesh floor = builder.take();
  bake_light({Eigen::Vector3f::Zero(), {{{0, 0, 2}, {1, 1, 1}, {0, 0, -1}}}}, floor);
  for (const Vertex& v : floor.vertices) {
    const float from_middle = v.position.head<2>().cwiseAbs().maxCoeff();
    if (from_middle < 0.4F) {
      EXPECT_EQ(v.light.x(), 0) << v.position.transpose();
    }
    if (from_middle > 0.7F) {
      EXPECT_GT(v.light.x(), 0) << v.position.transpose();
    }
  }
}

}  // namespace
}  // namespace stillmap::simulate
