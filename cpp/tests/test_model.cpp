#include "check.hpp"
#include "dynakin/model.hpp"
#include "models.hpp"

using namespace dynakin;

TEST(layout_has_one_named_block_a_kind_of_state) {
  const Model model(planar_chain());
  const char* names[6] = {"coordinates", "speeds", "accelerations", "lengths", "markers", "inertia"};
  const int sizes[6] = {7, 7, 7, 6, 34, 28};
  int offset = 0;
  for (int k = 0; k < 6; ++k) {
    const Block& block = model.layout().block(names[k]);
    CHECK(block.offset == offset && block.size == sizes[k]);
    offset += sizes[k];
  }
  CHECK(model.state_size() == 89);
  CHECK(model.layout().names()[21] == "length/l1");
}

TEST(locked_coordinates_and_fixed_lengths_are_not_in_the_state) {
  const Model model(spatial_tree());
  for (const std::string& name : model.layout().names()) CHECK(name != "fixed" && name != "length/c");
  CHECK(model.n_free() == 8);
}

TEST(a_wrong_model_is_refused_by_the_name_of_what_is_wrong) {
  const auto refused = [](auto change, const std::string& text) {
    ModelSpec spec = planar_chain();
    change(spec);
    check_refused([&] { Model model(spec); }, text);
  };
  refused([](ModelSpec& s) { s.segments[2].parent = "s9"; }, "segment 's2': parent: no earlier segment 's9'");
  refused([](ModelSpec& s) { s.segments[1].axes[0].coordinate = "knee"; }, "no coordinate 'knee'");
  refused([](ModelSpec& s) { s.segments[1].axes[0].direction *= 2.0; }, "expected a unit vector");
  refused([](ModelSpec& s) { s.segments[1].rotation *= 2.0; }, "not a rotation matrix");
  refused([](ModelSpec& s) { s.segments[1].lengths[0].parameter = "x"; }, "no geometry parameter 'x'");
  refused([](ModelSpec& s) { s.markers[0].segment = "foot"; }, "marker 'm00': no segment 'foot'");
  refused([](ModelSpec& s) { s.markers[1].name = "m00"; }, "marker 'm00' is declared twice");
  refused([](ModelSpec& s) { s.coordinates.push_back({"idle", 0.0, false}); }, "coordinate 'idle' moves no axis");
  refused([](ModelSpec& s) { s.segments.back().name = s.markers.back().segment = "ground"; },
          "the name stands for the ground itself");
  refused([](ModelSpec& s) { s.segments[3].inertia(0) = -1.0; }, "segment 's3': mass is -1");
  refused([](ModelSpec& s) { s.segments[0].inertia(0) = std::nan(""); }, "segment 's0': inertia");
}
