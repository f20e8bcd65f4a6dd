// SPDX-License-Identifier: Apache-2.0
// movers.csv and truth_movers.csv.
#include "stillmap/evaluate/mover_error.hpp"

#include "fuzz/fuzz_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  return {
      "timestamp,id,class,x,y,z,vx,vy,vz\n1.5,1,person,1,2,3,.1,0,0\n1.6,2,chair,1,2,3,0,0,-1\n",
      "# comment\ntimestamp,id,class,state,x,y,z,vx,vy,vz,pixels,shown,min_x,min_y,min_z,max_x,"
      "max_y,max_z\n0,0,person,observed,0,0,0,0,0,0,700,.5,-1,-1,-1,1,1,1\n"
      "1,0,person,predicted,0,0,0,0,0,0,0,0,-1,-1,-1,1,1,1\n"};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  const auto file = fuzz::file_with(fuzz::text_of(data, size));
  fuzz::parse([&] { read_movers(file); });
  return 0;
}
