// A test is a function that throws; TEST registers it, main.cpp runs all. (No test framework comes with g++ alone.)
#pragma once

#include <cmath>
#include <functional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <vector>

struct Test {
  std::string name;
  std::function<void()> body;
};
std::vector<Test>& all_tests();

struct Registration {
  Registration(const char* name, void (*body)()) { all_tests().push_back({name, body}); }
};
#define TEST(name)                                            \
  static void name();                                         \
  static const Registration registration_##name(#name, name); \
  static void name()

#define CHECK(condition)                                         \
  do {                                                           \
    if (!(condition)) {                                          \
      std::ostringstream text;                                   \
      text << __FILE__ << ":" << __LINE__ << ": " << #condition; \
      throw std::runtime_error(text.str());                      \
    }                                                            \
  } while (false)

#define CHECK_NEAR(a, b, tolerance)                                                                      \
  do {                                                                                                   \
    const double value_a = (a), value_b = (b);                                                           \
    if (!(std::abs(value_a - value_b) <= (tolerance))) {                                                 \
      std::ostringstream text;                                                                           \
      text.precision(17);                                                                                \
      text << __FILE__ << ":" << __LINE__ << ": " << #a << " = " << value_a << ", expected " << value_b; \
      throw std::runtime_error(text.str());                                                              \
    }                                                                                                    \
  } while (false)

// Expects std::invalid_argument whose message holds the text.
template <class F>
void check_refused(F&& f, const std::string& text) {
  try {
    f();
  } catch (const std::invalid_argument& e) {
    if (std::string(e.what()).find(text) == std::string::npos)
      throw std::runtime_error("refused with '" + std::string(e.what()) + "', expected a message with '" + text + "'");
    return;
  }
  throw std::runtime_error("not refused, expected '" + text + "'");
}
