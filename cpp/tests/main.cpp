#include <cstdio>

#include "check.hpp"

std::vector<Test>& all_tests() {
  static std::vector<Test> tests;
  return tests;
}

int main() {
  int failed = 0;
  for (const Test& test : all_tests()) {
    try {
      test.body();
      std::printf("ok      %s\n", test.name.c_str());
    } catch (const std::exception& e) {
      ++failed;
      std::printf("FAILED  %s: %s\n", test.name.c_str(), e.what());
    }
  }
  std::printf("%zu passed, %d failed\n", all_tests().size() - failed, failed);
  return failed == 0 ? 0 : 1;
}
