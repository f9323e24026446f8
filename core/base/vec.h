// Small fixed-size vectors. Templated on the scalar so that tests can run the same formulas on dual numbers.
#pragma once
#include <algorithm>
#include <cmath>

namespace isochron {

template <class T>
struct Vec3T {
  T x{}, y{}, z{};
  constexpr T& operator[](int i) { return i == 0 ? x : i == 1 ? y : z; }
  constexpr const T& operator[](int i) const { return i == 0 ? x : i == 1 ? y : z; }
  constexpr Vec3T& operator+=(const Vec3T& b) {
    x += b.x, y += b.y, z += b.z;
    return *this;
  }
  constexpr Vec3T& operator-=(const Vec3T& b) {
    x -= b.x, y -= b.y, z -= b.z;
    return *this;
  }
  constexpr Vec3T& operator*=(const T& s) {
    x *= s, y *= s, z *= s;
    return *this;
  }
  friend constexpr Vec3T operator+(const Vec3T& a, const Vec3T& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3T operator-(const Vec3T& a, const Vec3T& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3T operator-(const Vec3T& a) { return {-a.x, -a.y, -a.z}; }
  friend constexpr Vec3T operator*(const Vec3T& a, const T& s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3T operator*(const T& s, const Vec3T& a) { return a * s; }
  friend constexpr Vec3T operator/(const Vec3T& a, const T& s) { return {a.x / s, a.y / s, a.z / s}; }
  friend constexpr bool operator==(const Vec3T&, const Vec3T&) = default;
};

using Vec3 = Vec3T<double>;

template <class T>
constexpr T dot(const Vec3T<T>& a, const Vec3T<T>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
constexpr Vec3T<T> cross(const Vec3T<T>& a, const Vec3T<T>& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
constexpr T length_squared(const Vec3T<T>& a) {
  return dot(a, a);
}
template <class T>
T length(const Vec3T<T>& a) {
  using std::sqrt;
  return sqrt(dot(a, a));
}
template <class T>
Vec3T<T> normalize(const Vec3T<T>& a) {
  return a / length(a);
}

/// Two unit vectors that complete the unit vector n to a right-handed orthonormal frame (s, t, n).
inline void complete_frame(const Vec3& n, Vec3& s, Vec3& t) {
  const double sign = std::copysign(1.0, n.z);
  const double a = -1.0 / (sign + n.z);
  const double b = n.x * n.y * a;
  s = {1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x};
  t = {b, sign + n.y * n.y * a, -n.y};
}

/// Linear colour. Grey scenes keep the three channels equal and write only the first.
struct Rgb {
  double r = 0, g = 0, b = 0;
  constexpr Rgb() = default;
  constexpr Rgb(double red, double green, double blue) : r(red), g(green), b(blue) {}
  constexpr explicit Rgb(double grey) : r(grey), g(grey), b(grey) {}
  constexpr double& operator[](int i) { return i == 0 ? r : i == 1 ? g : b; }
  constexpr double operator[](int i) const { return i == 0 ? r : i == 1 ? g : b; }
  constexpr Rgb& operator+=(const Rgb& c) {
    r += c.r, g += c.g, b += c.b;
    return *this;
  }
  constexpr Rgb& operator*=(const Rgb& c) {
    r *= c.r, g *= c.g, b *= c.b;
    return *this;
  }
  constexpr Rgb& operator*=(double s) {
    r *= s, g *= s, b *= s;
    return *this;
  }
  friend constexpr Rgb operator+(Rgb a, const Rgb& c) { return a += c; }
  friend constexpr Rgb operator*(Rgb a, const Rgb& c) { return a *= c; }
  friend constexpr Rgb operator*(Rgb a, double s) { return a *= s; }
  friend constexpr Rgb operator*(double s, Rgb a) { return a *= s; }
  friend constexpr bool operator==(const Rgb&, const Rgb&) = default;
  constexpr double max() const { return std::max({r, g, b}); }
  constexpr bool is_black() const { return r == 0 && g == 0 && b == 0; }
};

}  // namespace isochron
