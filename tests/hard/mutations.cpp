#include "hard/mutations.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstring>
#include <random>
#include <utility>
#include <vector>

namespace vdb_diffuse {
namespace {

using Random = std::mt19937_64;
uint64_t below(Random& random, uint64_t end) {
  return random() % std::max<uint64_t>(end, 1);
}

/// A place to damage: half of the time where the file's frame, masks and counts lie.
size_t place(Random& random, const std::string& bytes) {
  return below(random, random() % 2 ? std::min<size_t>(bytes.size(), 2000) : bytes.size());
}

template <typename T>
void put(std::string& bytes, size_t at, T value) {
  if (at + sizeof value <= bytes.size()) std::memcpy(&bytes[at], &value, sizeof value);
}

void setField(Random& random, std::string& bytes) {
  constexpr int64_t kTelling[] = {0,         1,          -1,         2,          6,
                                  7,         255,        -128,       4096,       65535,
                                  0x100000,  0x7fffffff, 0x80000000, 0xffffffff, 0x10000000000,
                                  INT64_MAX, INT64_MIN};
  const int64_t value = kTelling[below(random, std::size(kTelling))];
  const size_t at = place(random, bytes);
  switch (below(random, 4)) {
    case 0:
      return put(bytes, at, static_cast<int32_t>(value));
    case 1:
      return put(bytes, at, value);
    case 2:
      return put(bytes, at, random() % 2 ? NAN : -1e38f);
    case 3:
      return put(bytes, at, random() % 2 ? double(INFINITY) : 1e-300);
  }
}

/// A small number, as counts and lengths are, somewhat larger or smaller.
void nudgeCount(Random& random, std::string& bytes) {
  for (int tries = 0; tries < 200; ++tries) {
    const size_t at = place(random, bytes);
    uint32_t value = 0;
    if (at + sizeof value > bytes.size()) continue;
    std::memcpy(&value, &bytes[at], sizeof value);
    if (value == 0 || value > 100000) continue;
    return put(bytes, at, static_cast<uint32_t>(value + below(random, 9) - 4));
  }
}

void mutateOnce(Random& random, std::string& bytes) {
  const size_t at = place(random, bytes), from = place(random, bytes);
  const size_t length = std::min<size_t>(1 + below(random, 64), bytes.size() - std::max(at, from));
  switch (below(random, 9)) {
    case 0:
      bytes[at] = static_cast<char>(random());
      break;
    case 1:
      bytes[at] = static_cast<char>(bytes[at] ^ (1 << random() % 8));
      break;
    case 2:
      bytes.resize(below(random, bytes.size()));
      break;
    case 3:
      bytes.replace(at, length, std::string(bytes, from, length));
      break;
    case 4:
      bytes.insert(at, bytes, from, length);
      break;
    case 5:
      bytes.erase(at, length);
      break;
    case 6:
      setField(random, bytes);
      break;
    case 7:
      nudgeCount(random, bytes);
      break;
    case 8:
      std::fill_n(&bytes[at], length, random() % 2 ? '\0' : '\xff');
      break;
  }
}

/// Where the n-th piece of text begins that `in` holds for, and how long it is.
template <typename In>
std::pair<size_t, size_t> anyPiece(Random& random, const std::string& text, const In& in) {
  std::vector<std::pair<size_t, size_t>> pieces;
  for (size_t at = 0; at < text.size(); ++at) {
    if (!in(text[at])) continue;
    const size_t begin = at;
    while (at < text.size() && in(text[at])) ++at;
    pieces.emplace_back(begin, at - begin);
  }
  return pieces.empty() ? std::pair<size_t, size_t>(0, 0) : pieces[below(random, pieces.size())];
}

bool isOfNumber(char c) {
  return std::isdigit(static_cast<unsigned char>(c)) || std::strchr("+-.eE", c);
}
bool isOfWord(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.';
}

std::string tellingText(Random& random) {
  static const std::string kTelling[] = {"0",
                                         "-0",
                                         "-1",
                                         "1",
                                         "2",
                                         "3",
                                         "0.5",
                                         "255",
                                         "65536",
                                         "2147483647",
                                         "-2147483648",
                                         "4294967296",
                                         "18446744073709551616",
                                         "1e38",
                                         "-1e39",
                                         "1e-320",
                                         "1e300",
                                         "1e999",
                                         "nan",
                                         "NaN",
                                         "-inf",
                                         "Infinity",
                                         "null",
                                         "true",
                                         "[]",
                                         "{}",
                                         "\"\"",
                                         "[1,2,3]",
                                         "\"../../../../etc/passwd\"",
                                         "\"/dev/zero\"",
                                         "\"\\u0000\"",
                                         "\xff\xfe",
                                         std::string(5000, 'a'),
                                         std::string(200, '9')};
  return kTelling[below(random, std::size(kTelling))];
}

void mutateTextOnce(Random& random, std::string& text) {
  switch (below(random, 8)) {
    case 0:
    case 1: {
      const auto [at, length] = anyPiece(random, text, isOfNumber);
      text.replace(at, length, tellingText(random));
      break;
    }
    case 2: {
      const auto [at, length] = anyPiece(random, text, isOfWord);
      text.replace(at, length, tellingText(random));
      break;
    }
    case 3: {  // one word for another of the same file
      const auto [from, from_length] = anyPiece(random, text, isOfWord);
      const std::string word = text.substr(from, from_length);
      const auto [at, length] = anyPiece(random, text, isOfWord);
      text.replace(at, length, word);
      break;
    }
    case 4:
    case 5: {  // a line, or what lies between commas, twice or not at all
      const char end = random() % 2 ? '\n' : ',';
      const auto [at, length] = anyPiece(random, text, [end](char c) { return c != end; });
      if (random() % 2)
        text.insert(at, text.substr(at, length) + end);
      else
        text.erase(at, length);
      break;
    }
    case 6: {
      const std::string brackets[] = {"[",  "{", "\"", "]", "}", ",", ":", "\\", std::string(1, '\0'),
                                      "/*", "//"};
      text.insert(below(random, text.size() + 1), brackets[below(random, std::size(brackets))]);
      break;
    }
    case 7:
      mutateOnce(random, text);
      break;
  }
}

template <typename Once>
std::string mutated(uint64_t seed, std::string bytes, size_t least, const Once& once) {
  Random random(seed);
  const int times = 1 + static_cast<int>(below(random, 3));
  for (int n = 0; n < times && bytes.size() > least; ++n) once(random, bytes);
  return bytes;
}

}  // namespace

std::string mutatedBytes(uint64_t seed, std::string bytes) {
  return mutated(seed, std::move(bytes), 100, mutateOnce);
}

std::string mutatedText(uint64_t seed, std::string text) {
  return mutated(seed, std::move(text), 10, mutateTextOnce);
}

}  // namespace vdb_diffuse
