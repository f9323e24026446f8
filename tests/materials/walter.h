// The rough dielectric of Walter et al. 2007 as the paper writes it: half vectors, Snell's law, Fresnel's equations. For
// dual numbers and extended precision.
#pragma once
#include <cmath>

namespace isochron::textbook {

using std::abs, std::sqrt;

/// Reflectance from the cosines of incidence and refraction on sides of index n1, n2.
template <class T>
T fresnel(const T& cos1, const T& cos2, const T& n1, const T& n2) {
  const T s = (n1 * cos1 - n2 * cos2) / (n1 * cos1 + n2 * cos2);
  const T p = (n2 * cos1 - n1 * cos2) / (n2 * cos1 + n1 * cos2);
  return (s * s + p * p) / T(2);
}

template <class T>
T ggx(const T& cos_h, const T& alpha) {
  const T tan2 = (T(1) - cos_h * cos_h) / (cos_h * cos_h), factor = T(1) + tan2 / (alpha * alpha);
  return T(1) /
         (T(3.14159265358979323846264338327950288L) * alpha * alpha * cos_h * cos_h * cos_h * cos_h * factor * factor);
}

template <class T>
T smith_g1(const T& cosine, const T& alpha) {
  const T tan2 = (T(1) - cosine * cosine) / (cosine * cosine);
  return T(2) / (T(1) + sqrt(T(1) + alpha * alpha * tan2));
}

/// f of light from i to o; zero where no microfacet takes one to the other.
template <class T>
T walter(const T& cos_i, const T& cos_o, const T& c, const T& alpha, const T& ior) {
  const T n_i = cos_i > T(0) ? T(1) : ior, n_o = cos_o > T(0) ? T(1) : ior;
  const T shape = smith_g1(cos_i, alpha) * smith_g1(cos_o, alpha);
  if ((cos_i > T(0)) == (cos_o > T(0))) {
    const T cos_h = (cos_i + cos_o) / sqrt(T(2) + T(2) * c), x = sqrt((T(1) + c) / T(2));
    const T beyond = cos_o > T(0) ? ior : T(1), sine2 = n_o * n_o / (beyond * beyond) * (T(1) - x * x);
    const T f = sine2 < T(1) ? fresnel(x, sqrt(T(1) - sine2), n_o, beyond) : T(1);
    return f * shape * ggx(cos_h, alpha) / (T(4) * cos_i * cos_o);
  }
  // Walter's Eqs. 16 and 21; the half vector points to the outside.
  const T norm = sqrt(n_i * n_i + n_o * n_o + T(2) * n_i * n_o * c);
  T i_h = -(n_i + n_o * c) / norm, o_h = -(n_i * c + n_o) / norm, n_h = -(n_i * cos_i + n_o * cos_o) / norm;
  if (ior < T(1)) i_h = -i_h, o_h = -o_h, n_h = -n_h;
  if (!(i_h * cos_i > T(0) && o_h * cos_o > T(0) && n_h > T(0))) return T(0);
  const T a_i = abs(i_h), a_o = abs(o_h), sum = n_i * i_h + n_o * o_h;
  return a_i * a_o / abs(cos_i * cos_o) * n_o * n_o * (T(1) - fresnel(a_o, a_i, n_o, n_i)) * shape * ggx(n_h, alpha) /
         (sum * sum);
}

}  // namespace isochron::textbook
