// What follows from one description: reading, writing, the page.
#include "core/base/description.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/scene/temporary_folder.h"

namespace isochron {

enum class Form { round, square };
template <>
inline constexpr auto kChoices<Form> = std::to_array<Choice<Form>>({{Form::round, "round", "without corners"},
                                                                    {Form::square, "square", ""}});

namespace {

struct Hole {
  double depth = 0;
};

struct Plate {
  Form form = Form::round;
  double radius = 2, side = 3;
  std::string label;
  std::vector<Hole> holes;
  std::vector<std::string> paints;
  std::vector<double> prices;
};

void describe(Keys& keys, Plate& plate) {
  keys.value("form", field::choice(plate.form), "its outline", {.required = true});
  keys.value("radius", field::positive(plate.radius), "from the middle",
             {.only = only(plate.form, {Form::round}), .unit = "mm"});
  keys.value("side", field::positive(plate.side), "of the square", {.only = only(plate.form, {Form::square})});
  keys.value("label", field::text(plate.label), "what it is called", {.unset = plate.label.empty()});
  keys.list("holes", plate.holes,
            [](Keys& inner, Hole& hole) { inner.value("depth", field::number(hole.depth), "", {.required = true}); },
            "in it", {.unset = plate.holes.empty()});
  const auto paint = [&](Keys& inner, const std::string& name) {
    std::size_t i = 0;
    while (i < plate.paints.size() && plate.paints[i] != name) ++i;
    plate.paints.resize(std::max(i + 1, plate.paints.size()), name);
    plate.prices.resize(plate.paints.size());
    inner.value("price", field::number(plate.prices[i]), "");
  };
  keys.named("paints", std::vector(plate.paints), paint, "on it", {.unset = plate.paints.empty()});
}

Plate read(const std::string& text) {
  const TemporaryFolder folder;
  const YamlValue value = open_yaml(folder.write("plate.yaml", text));
  Plate plate;
  read_keys(value, [&](Keys& keys) { describe(keys, plate); });
  return plate;
}

std::vector<WrittenKey> written(Plate plate) {
  return written_keys([&](Keys& keys) { describe(keys, plate); });
}

const std::string kPlate =
    "form: square\nside: 1.5\nlabel: \"a \\\"b\\\"\"\nholes:\n  - depth: 1\n  - depth: 0.1\npaints:\n  red:\n    "
    "price: 7\n"
    "  blue:\n    price: 8\n";

std::string message(const std::string& text) {
  try {
    read(text);
    return "accepted";
  } catch (const InputError& error) {
    const std::string what = error.what();
    return what.substr(what.find(".yaml:") + 6);
  }
}

TEST(Description, WhatIsWrittenReadsBack) {
  const Plate plate = read(kPlate);
  EXPECT_EQ(plate.form, Form::square);
  EXPECT_EQ(plate.radius, 2);
  EXPECT_EQ(plate.side, 1.5);
  EXPECT_EQ(plate.holes.size(), 2u);
  EXPECT_EQ(plate.prices, (std::vector<double>{7, 8}));
  EXPECT_EQ(yaml(written(plate)), kPlate);
  EXPECT_EQ(yaml(written(read("form: round\n"))), "form: round\nradius: 2\n");
}

TEST(Description, SelectsKeysWithWhatTheyAreIn) {
  EXPECT_EQ(yaml(selected(written(read(kPlate)), {"side", "paints.red"})),
            "side: 1.5\npaints:\n  red:\n    price: 7\n");
}

TEST(Description, RefusesWhatBelongsElsewhere) {
  EXPECT_EQ(message("side: 1\n"), "1:1: form: is missing");
  EXPECT_EQ(message("form: oval\n"), "1:7: form: 'oval' is not known (allowed: round, square)");
  EXPECT_EQ(message("form: round\nside: 1\n"),
            "2:1: side: belongs to square, not to round (allowed: form, radius, label, holes, paints)");
  EXPECT_EQ(message("form: round\nholes: [{depth: 1}, {}]\n"), "2:21: holes[1].depth: is missing");
}

TEST(Description, PageHasEveryKey) {
  Plate plate;
  const std::string head = "\n\n| Key | Type | Unit | Default | Allowed | Meaning |\n|---|---|---|---|---|---|\n";
  EXPECT_EQ(reference_tables([&](Keys& keys) { describe(keys, plate); }),
            "### At the top" + head +
                "| `form` | word |  | required | `round`, `square` | its outline. `round`: without corners |\n"
                "| `radius` | number | mm | `2` | above 0 | *round:* from the middle |\n"
                "| `side` | number |  | `3` | above 0 | *square:* of the square |\n"
                "| `label` | text |  | none |  | what it is called |\n"
                "| `holes` | list of maps |  | none |  | in it; see below |\n"
                "| `paints` | map of maps, by name |  | none |  | on it; see below |\n"
                "\n### `holes`" +
                head + "| `depth` | number |  | required |  |  |\n\n### `paints`" + head +
                "| `price` | number |  | `0` |  |  |\n");
}

TEST(Description, TablesHaveTheirPlace) {
  EXPECT_EQ(with_tables("a\n<!-- keys -->\nold\n<!-- /keys -->\nb\n", "new\n"),
            "a\n<!-- keys -->\n\nnew\n\n<!-- /keys -->\nb\n");
  EXPECT_THROW(with_tables("<!-- /keys -->\n<!-- keys -->\n", ""), InputError);
}

}  // namespace
}  // namespace isochron
