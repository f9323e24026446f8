// What a surface does with light: the interface of a kind of material (bidirectional scattering distribution function,
// BSDF). Each kind has a file of its own in this folder and a line in registry.cpp.
#pragma once
#include <array>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "core/base/constants.h"
#include "core/base/description.h"
#include "core/base/frame.h"
#include "core/base/vec.h"

namespace isochron {

/// Unit vectors at a surface point: its normal, w_i towards the light side and w_o towards the camera side of a path.
struct Directions {
  Vec3 n, w_i, w_o;
  double cos_i, cos_o, cos_io;  ///< n.w_i, n.w_o, w_i.w_o

  static Directions between(const Vec3& n, const Vec3& w_i, const Vec3& w_o) {
    return {n, w_i, w_o, dot(n, w_i), dot(n, w_o), dot(w_i, w_o)};
  }
  /// The same light path the other way.
  Directions reversed() const { return {n, w_o, w_i, cos_o, cos_i, cos_io}; }
};

/// Scalars of a kind that can be differentiated, at most: colours count three.
inline constexpr int kMostNumbers = 8;

/// Derivative of ln f, for each colour.
struct BsdfDerivative {
  struct ByDirections {
    Vec3 n, w_i, w_o;  ///< as if the three were free vectors
  };
  std::array<ByDirections, 3> by_directions;
  bool coloured = false;                      ///< by_directions differ among the colours
  std::array<Rgb, kMostNumbers> by_number{};  ///< by each number of quantities()

  /// Where f is a function of the three cosines: from the derivatives by these. `side`: see Bsdf::face_forward.
  void set_cosines(int colour, const Directions& d, double side, double by_cos_i, double by_cos_o, double by_cos_io) {
    by_directions[colour] = {(d.w_i * by_cos_i + d.w_o * by_cos_o) * side, d.n * by_cos_i + d.w_o * by_cos_io,
                             d.n * by_cos_o + d.w_i * by_cos_io};
  }
  /// The same for all colours.
  void set_cosines(const Directions& d, double side, double by_cos_i, double by_cos_o, double by_cos_io) {
    set_cosines(0, d, side, by_cos_i, by_cos_o, by_cos_io);
    by_directions[1] = by_directions[2] = by_directions[0];
  }
};

/// What a path that is traced vertex by vertex transports, and so which of the two directions is drawn given the other.
enum class TransportMode {
  radiance,   ///< traced from the camera towards the light: w_i is drawn, w_o given
  importance  ///< traced towards the camera: w_o is drawn, w_i given
};

struct DirectionSample {
  Vec3 direction;  ///< unit, world space
  double pdf;      ///< per solid angle
  Rgb weight;      ///< f |cosine of the direction| / pdf
};

/// A number (one value) or a colour (three) that can be differentiated.
struct Quantity {
  struct Range {
    double lowest, highest;
  };
  const char* name;  ///< its key in scene files, and the type of its parameters
  std::span<double> values;
  Range (*range)(double initial);  ///< what an optimisation that starts there may make of it
  const char* other_name = "";     ///< another type of parameter that means it
};
/// The values of a colour.
inline std::span<double> numbers_of(Rgb& colour) {
  return {&colour.r, 3};
}
/// Of albedos and reflectances.
Quantity::Range fraction_range(double initial);
/// Of alpha.
Quantity::Range roughness_range(double initial);

class Bsdf {
 public:
  virtual ~Bsdf() = default;
  virtual std::unique_ptr<Bsdf> clone() const = 0;

  /// Its keys in scene files. `grey` becomes false where a colour is given as three numbers.
  virtual void describe(Keys& keys, bool& grey) = 0;
  /// What can be differentiated. Numbers are counted along this list.
  virtual std::vector<Quantity> quantities() = 0;
  /// To be called when numbers were set through quantities(): what follows from them is computed once, here.
  virtual void numbers_changed() {}

  /// f in 1/sr, without cosine; that of radiance which travels from w_i to w_o. Zero where nothing is scattered.
  virtual Rgb value(const Directions& d) const = 0;
  /// Of ln(value); all zero for colours whose value is zero.
  virtual BsdfDerivative derivative(const Directions& d) const = 0;
  /// Density per solid angle with which `sample` draws w_i given w_o. Integrates to less than one where some draws end
  /// below the surface and are dropped. Of Directions::reversed(): that of w_o given w_i.
  virtual double pdf(const Directions& d) const = 0;
  /// Draws one direction given the other; both point away from the surface, whose normal is n. Empty when nothing is
  /// scattered. u2 counts where dimensions() is 3.
  virtual std::optional<DirectionSample> sample(const Vec3& n, const Vec3& given, double u0, double u1, double u2,
                                                TransportMode mode) const = 0;
  /// Random numbers that `sample` needs, 2 or 3.
  virtual int dimensions() const { return 2; }
  /// Whether f depends on directions, wherever it is not zero.
  virtual bool depends_on_directions() const { return true; }
  /// Which number is the index of refraction of the solid behind its faces; -1: it is opaque. Transparent faces scatter on,
  /// from and to both sides.
  virtual int index_number() const { return -1; }

  bool transparent() const { return index_number() >= 0; }
  /// Whether an opaque surface reflects on its back as it does on its front.
  bool two_sided() const { return two_sided_; }
  void set_two_sided(bool both) { two_sided_ = both; }

 protected:
  /// The key `two_sided`.
  void describe_two_sided(Keys& keys);
  /// Turns the normal to the side that w_o is on where that counts as a front; -1 where it did, else 1. 0: nothing is
  /// scattered.
  double face_forward(Directions& d) const {
    const bool behind = two_sided_ && d.cos_o < 0;
    if (behind) {
      d.n = -d.n;
      d.cos_i = -d.cos_i;
      d.cos_o = -d.cos_o;
    }
    return !(d.cos_i > 0 && d.cos_o > 0) ? 0 : behind ? -1 : 1;
  }
  /// The same for one direction.
  bool face_forward(Vec3& n, const Vec3& given) const {
    if (two_sided_ && dot(n, given) < 0) n = -n;
    return dot(n, given) > 0;
  }

 private:
  bool two_sided_ = false;
};

}  // namespace isochron
