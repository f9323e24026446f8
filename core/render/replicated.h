// Passes that render replicates of images: none is kept as an image of its own, as pixels are done one after the other, each of
// all replicates.
#pragma once
#include <bit>
#include <utility>
#include <vector>

#include "core/base/listed_sum.h"
#include "core/base/progress.h"
#include "core/films/film.h"
#include "core/films/replicates.h"
#include "core/render/passes.h"

namespace isochron {

/// What is rendered: so many images at a time, each from all of the ranges of samples.
struct Replicates {
  PassKind kind;
  int columns;
  const Stream& stream;
  const std::vector<SampleRange>& ranges;
  bool lit;             ///< whether there is any light
  bool stay_in_pixels;  ///< whether samples add only to their own pixel, and there are enough pixels to share
};

class ReplicatedPasses {
 public:
  /// What these refer to must outlive this.
  ReplicatedPasses(const Passes& passes, const Replicates& what)
      : passes_(passes),
        what_(what),
        pixels_(passes.scene.pixels()),
        gates_(passes.gates.size()),
        channels_(passes.scene.scene.grey ? 1 : 3),
        values_(static_cast<std::size_t>(gates_) * channels_),
        count_(Partition{0, kMostPartitions}.pixel_parts(pixels_)) {
    std::vector<double> samples;
    for (const SampleRange& range : what.ranges) samples.push_back(range.count());
    weight_ = shares(samples);
  }

  /// run(pass, films, partition) adds light to a film for each column; on_all_gates(column, pixel) is added to all values of a
  /// pixel.
  template <class Run, class OnAllGates>
  std::vector<ReplicatedImage> render(Run&& run, OnAllGates&& on_all_gates) const {
    const bool by_sums = what_.lit && !what_.stay_in_pixels;
    ProgressStage stage("rendering", by_sums ? replicates() + 1 : 1);
    std::vector<ListedSum> sums;
    for (int r = 0; by_sums && r < replicates(); ++r) {
      const Pass pass{what_.stream, what_.ranges[r]};
      sums.push_back(passes_.sum_of_films(
          what_.kind, pass.range, what_.columns,
          [&](const std::vector<Film>& films, Partition partition) { run(pass, films, partition); }));
      stage.advance();
    }
    std::vector<ReplicatedImage> images(what_.columns);
    const StoredImage black(passes_.scene.camera.width, passes_.scene.camera.height, gates_, channels_);
    for (ReplicatedImage& image : images) image.mean = black;
    SharedPartitions shared(count_, by_sums ? nullptr : passes_.partition_costs(what_.kind, count_));
    Sums all = sum_of_partitions<Sums>(shared, [&](int i) {
      const Partition partition{i, count_};
      const ListedSum own = what_.lit && !by_sums ? own_pixels(partition, run) : ListedSum();
      Sums of_columns{std::vector<GateSums>(what_.columns, GateSums(gates_, channels_, weight_))};
      ReplicatedPixel values(of_columns.of[0]);
      Passes::for_each_pixel(partition, pixels_, [&](int pixel) {
        for (int column = 0; column < what_.columns; ++column) {
          for (int r = 0; what_.lit && r < replicates(); ++r) {
            const std::size_t begin = by_sums ? (static_cast<std::size_t>(column) * pixels_ + pixel) * values_
                                              : own_index(column, r, place_in_part(pixel, log_parts()));
            (by_sums ? sums[r] : own).for_each(begin, begin + values_, [&](std::size_t at, double value) {
              if (value != 0) values.add(r, at - begin, value);
            });
          }
          if (const double more = on_all_gates(column, pixel); more != 0)
            for (int r = 0; r < replicates(); ++r)
              for (std::size_t place = 0; place < values_; ++place) values.add(r, place, more);
          values.finish(pixel, of_columns.of[column], images[column].mean);
        }
      });
      return of_columns;
    });
    share(shared.parts, images);
    for (int column = 0; column < what_.columns; ++column) images[column].gates = std::move(all.of[column]);
    return images;
  }

 private:
  /// Of one partition or of several, a GateSums for each column.
  struct Sums {
    std::vector<GateSums> of;
    void add(const Sums& other);
    void pack(Packer& packer) const;
    void unpack(Unpacker& unpacker);
  };

  int replicates() const { return static_cast<int>(what_.ranges.size()); }
  int log_parts() const { return std::bit_width(static_cast<unsigned>(count_)) - 1; }
  /// Where a pixel's values begin in own_pixels(), by its place_in_part().
  std::size_t own_index(int column, int replicate, int place) const {
    const std::size_t blocks = (Partition::blocks(pixels_) + count_ - 1) / count_;
    return ((static_cast<std::size_t>(column) * replicates() + replicate) * blocks * kPixelsPerBlock + place) * values_;
  }

  /// Of one partition, where samples stay in its pixels: [column][replicate][pixel].
  template <class Run>
  ListedSum own_pixels(Partition partition, Run&& run) const {
    ListedSum own(own_index(what_.columns, 0, 0));
    for (int r = 0; r < replicates(); ++r) {
      std::vector<Film> films;
      for (int column = 0; column < what_.columns; ++column)
        films.emplace_back(gates_, channels_, own, own_index(column, r, 0), count_);
      run(Pass{what_.stream, what_.ranges[r]}, films, partition);
    }
    own.finish();
    return own;
  }
  /// Completes the pixels of other ranks.
  void share(const RankParts& parts, std::vector<ReplicatedImage>& images) const;

  const Passes& passes_;
  const Replicates what_;
  const int pixels_, gates_, channels_;
  const std::size_t values_;  ///< of a pixel
  const int count_;           ///< partitions, each with pixels of its own
  std::vector<double> weight_;
};

}  // namespace isochron
