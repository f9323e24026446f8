#include "core/base/yaml_reader.h"

#include <gtest/gtest.h>

#include "tests/scene/temporary_folder.h"

namespace isochron {
namespace {

class YamlReader : public ::testing::Test {
 protected:
  YamlValue open(const std::string& text, const std::vector<std::string>& overrides = {}) {
    return open_yaml(folder.write("f.yaml", text), overrides);
  }
  YamlValue value(const std::string& text) { return open("k: " + text).map().require("k"); }
  /// The message that `action` fails with, without the folder of the file.
  template <class Action>
  std::string error(Action&& action) {
    std::string message = error_of(action);
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    const std::string prefix = folder.path("");
    if (message.starts_with(prefix)) message.erase(0, prefix.size());
    return message;
  }

  TemporaryFolder folder;
};

TEST_F(YamlReader, ReadsEveryType) {
  YamlMap map =
      open("a: -1.5e2\nb: +7\nc: true\nd: word\ne: [1, 2, 3]\nf: {g: 0.25}\nh: 0.5\ni: [0.1, 0.2, 0.3]\n").map();
  EXPECT_EQ(map.require("a").number(), -150);
  EXPECT_EQ(map.require("b").integer(0, 10), 7);
  EXPECT_TRUE(map.require("c").boolean());
  EXPECT_EQ(map.require("d").text(), "word");
  EXPECT_EQ(map.require("d").choice({"a", "word"}), 1);
  EXPECT_EQ(map.require("e").vec3(), (Vec3{1, 2, 3}));
  EXPECT_EQ(map.require("e").numbers(), (std::vector<double>{1, 2, 3}));
  const YamlValue g = map.require("f").map().require("g");
  EXPECT_EQ(g.key(), "f.g");
  EXPECT_EQ(g.number(NumberRange::closed(0, 1)), 0.25);
  bool grey = true;
  EXPECT_EQ(map.require("h").color({}, grey), Rgb(0.5));
  EXPECT_TRUE(grey);
  EXPECT_EQ(map.require("i").color({}, grey), Rgb(0.1, 0.2, 0.3));
  EXPECT_FALSE(grey);
  EXPECT_FALSE(map.find("absent").has_value());
  EXPECT_NO_THROW(map.reject_unknown());
}

TEST_F(YamlReader, NumbersAreExactAndFinite) {
  EXPECT_EQ(value("0.1").number(), 0.1);
  EXPECT_EQ(value("123456789012345678").integer(0, 200000000000000000), 123456789012345678);
  const std::string tail = " is not a finite number (a finite number)";
  for (const std::string word : {".nan", "nan", ".inf", "inf", "1e999", "0x10", "1.0f", "12,5", "one", "+-1"})
    EXPECT_EQ(error([&] { value(word).number(); }), "f.yaml:1:4: k: '" + word + "'" + tail);
  EXPECT_EQ(error([&] { value("\"1\"").number(); }), "f.yaml:1:4: k: '1'" + tail);
  EXPECT_EQ(error([&] { value("[1, 2]").number(); }), "f.yaml:1:4: k: a list of 2" + tail);
  EXPECT_EQ(error([&] { value("{a: 1}").number(); }), "f.yaml:1:4: k: a map" + tail);
  EXPECT_NE(error([&] { value("").number(); }).find("k: nothing" + tail), std::string::npos);
}

TEST_F(YamlReader, Ranges) {
  const auto with = [&](const std::string& text, const NumberRange& range) {
    return error([&] { value(text).number(range); });
  };
  EXPECT_EQ(with("0", NumberRange::positive()), "f.yaml:1:4: k: 0 is out of range (a number above 0)");
  EXPECT_EQ(with("-0.5", NumberRange::non_negative()), "f.yaml:1:4: k: -0.5 is out of range (a number at least 0)");
  EXPECT_EQ(with("1.5", NumberRange::closed(0, 1)),
            "f.yaml:1:4: k: 1.5 is out of range (a number at least 0, at most 1)");
  EXPECT_EQ(with("2", {.high = 2, .high_open = true}), "f.yaml:1:4: k: 2 is out of range (a number below 2)");
  EXPECT_EQ(with("0", NumberRange::non_negative()), "no error");
  EXPECT_EQ(with("1", NumberRange::closed(0, 1)), "no error");
  EXPECT_EQ(with("1e-300", NumberRange::positive()), "no error");

  const auto integer = [&](const std::string& text) { return error([&] { value(text).integer(1, 8); }); };
  EXPECT_EQ(integer("1"), "no error");
  EXPECT_EQ(integer("8"), "no error");
  EXPECT_EQ(integer("0"), "f.yaml:1:4: k: 0 is out of range (an integer from 1 to 8)");
  EXPECT_EQ(integer("9"), "f.yaml:1:4: k: 9 is out of range (an integer from 1 to 8)");
  EXPECT_EQ(integer("2.5"), "f.yaml:1:4: k: '2.5' is not an integer that fits (an integer from 1 to 8)");
  EXPECT_EQ(integer("99999999999999999999"),
            "f.yaml:1:4: k: '99999999999999999999' is not an integer that fits (an integer from 1 to 8)");
}

TEST_F(YamlReader, WrongTypes) {
  bool grey = true;
  EXPECT_EQ(error([&] { value("yes").boolean(); }), "f.yaml:1:4: k: 'yes' is neither (true or false)");
  EXPECT_EQ(error([&] { value("[a]").text(); }), "f.yaml:1:4: k: a list of 1 is not a word (a text)");
  EXPECT_EQ(error([&] { value("''").text(); }), "f.yaml:1:4: k: is empty (a text)");
  EXPECT_EQ(error([&] { value("3").list(); }), "f.yaml:1:4: k: '3' is not a list ([entry, ...])");
  EXPECT_EQ(error([&] { value("3").map(); }), "f.yaml:1:4: k: '3' is not a map (keys and values)");
  EXPECT_EQ(error([&] { value("[1, 2]").vec3(); }), "f.yaml:1:4: k: a list of 2 is not a vector ([x, y, z])");
  EXPECT_EQ(error([&] { value("[1, b, 2]").vec3(); }),
            "f.yaml:1:8: k[1]: 'b' is not a finite number (a finite number)");
  EXPECT_EQ(error([&] { value("[0, 0, -0.0]").direction(); }),
            "f.yaml:1:4: k: the zero vector has no direction ([x, y, z], not all zero)");
  EXPECT_EQ(error([&] { value("[1, 2]").color({}, grey); }),
            "f.yaml:1:4: k: a list of 2 is not a colour (a number or [r, g, b])");
  EXPECT_EQ(error([&] { value("{r: 1}").color({}, grey); }),
            "f.yaml:1:4: k: a map is not a colour (a number or [r, g, b])");
  EXPECT_EQ(error([&] { value("[1, -2, 0]").color(NumberRange::non_negative(), grey); }),
            "f.yaml:1:8: k[1]: -2 is out of range (a number at least 0)");
  EXPECT_EQ(error([&] {
              value("adm").choice({"lbfgs", "adam"});
            }),
            "f.yaml:1:4: k: 'adm' is not known, did you mean 'adam'? (allowed: lbfgs, adam)");
  EXPECT_EQ(error([&] {
              value("newton").choice({"lbfgs", "adam"});
            }),
            "f.yaml:1:4: k: 'newton' is not known (allowed: lbfgs, adam)");
}

TEST_F(YamlReader, MissingUnknownAndRepeatedKeys) {
  const auto read = [&](const std::string& text) {
    return error([&] {
      YamlMap map = open(text).map();
      YamlMap inner = map.require("inner").map();
      inner.require("width");
      inner.find("height");
      inner.reject_unknown();
      map.reject_unknown();
    });
  };
  EXPECT_EQ(read("inner: {width: 1}\n"), "no error");
  EXPECT_EQ(read("other: 1\n"), "f.yaml:1:1: inner: is missing");
  EXPECT_EQ(read("inner:\n  height: 2\n"), "f.yaml:2:3: inner.width: is missing");
  EXPECT_EQ(read("inner:\n  wdith: 2\n"), "f.yaml:2:3: inner.width: is missing, is 'wdith' a misspelling of it?");
  EXPECT_EQ(read("inner:\n  width: 2\n  hieght: 3\n"),
            "f.yaml:3:3: inner.hieght: is not a known key, did you mean 'height'? (allowed: width, height)");
  EXPECT_EQ(read("inner: {width: 2}\n\nzebra: 3\n"), "f.yaml:3:1: zebra: is not a known key (allowed: inner)");
  EXPECT_EQ(read("inner:\n  width: 2\n  height: 1\n  width: 3\n"),
            "f.yaml:4:3: inner.width: is given twice, first on line 2");
  EXPECT_EQ(read("inner: {[1]: 2}\n"), "f.yaml:1:9: inner: a list of 1 is used as a key (a word)");
}

TEST_F(YamlReader, SyntaxErrorsAndUnreadableFiles) {
  const std::string unclosed = error([&] { open("a: 1\nb: [1, 2\nc: 3\n"); });
  EXPECT_TRUE(unclosed.starts_with("f.yaml:3:2: syntax: ")) << unclosed;
  const std::string tab = error([&] { open("a:\n\tb: 1\n"); });
  EXPECT_TRUE(tab.starts_with("f.yaml:2:3: syntax: ")) << tab;
  const std::string alias = error([&] { open("a: 1\nb: *nobody\n"); });
  EXPECT_TRUE(alias.starts_with("f.yaml:2:4: syntax: ")) << alias;
  EXPECT_EQ(error([&] { open(""); }), "f.yaml:1:1: syntax: is empty");
  EXPECT_EQ(error([&] { open("a: 1\n---\nb: 2\n"); }),
            "f.yaml:2:1: syntax: a second document begins (one per file is allowed)");
  // yaml-cpp's own way to read all documents does not return from this one.
  EXPECT_EQ(error([&] { open(" , a: 1}\n"); }),
            "f.yaml:1:2: syntax: a second document begins (one per file is allowed)");
  EXPECT_EQ(error([&] { open_yaml(folder.path("none.yaml")); }),
            "none.yaml:1:1: file: cannot be opened: No such file or directory");
  std::filesystem::create_directory(folder.path("sub"));
  EXPECT_EQ(error([&] { open_yaml(folder.path("sub")); }), "sub:1:1: file: is a folder (a YAML file)");
  EXPECT_NE(error([&] { open(std::string(5000, '[')); }), "no error");
}

TEST_F(YamlReader, MessagesStayOnOneLine) {
  EXPECT_EQ(error([&] { value("\"one\\ntwo\"").number(); }),
            "f.yaml:1:4: k: 'one two' is not a finite number (a finite number)");
  EXPECT_EQ(error([&] { value(std::string(100, 'x')).number(); }),
            "f.yaml:1:4: k: '" + std::string(40, 'x') + "...' is not a finite number (a finite number)");
}

TEST_F(YamlReader, Overrides) {
  const std::string text = "a: {b: 1, c: 2}\nlist:\n  - {x: 1}\n  - {x: 2}\n";
  YamlMap map = open(text, {"a.b=5", "list[1].x=7", "new=[1, 2]", "a.d={e: 3}", "a.d.e=4"}).map();
  YamlMap a = map.require("a").map();
  EXPECT_EQ(a.require("b").number(), 5);
  EXPECT_EQ(a.require("c").number(), 2);
  EXPECT_EQ(a.require("d").map().require("e").number(), 4);
  EXPECT_EQ(map.require("list").list()[0].map().require("x").number(), 1);
  EXPECT_EQ(map.require("list").list()[1].map().require("x").number(), 7);
  EXPECT_EQ(map.require("new").numbers(), (std::vector<double>{1, 2}));

  const YamlMap named =
      open("list: [{name: a, x: 1}, {name: b, x: 2}]\n", {"list.b.x=7"}).map().require("list").list()[1].map();
  EXPECT_EQ(YamlMap(named).require("x").number(), 7);

  // Errors name the override where the value comes from it, and the file elsewhere.
  const auto inner = [&](const std::vector<std::string>& overrides, const std::string& key) {
    return error([&] { open(text, overrides).map().require("a").map().require(key).boolean(); });
  };
  EXPECT_EQ(inner({"a.b=5"}, "b"), "--set a.b:1:1: a.b: '5' is neither (true or false)");
  EXPECT_EQ(inner({"a.b=5"}, "c"), "f.yaml:1:14: a.c: '2' is neither (true or false)");
  EXPECT_EQ(error([&] { open(text, {"a"}); }), "--set a: must be KEY.PATH=VALUE");
  EXPECT_EQ(error([&] { open(text, {"a..b=1"}); }), "--set a..b=1: must be KEY.PATH=VALUE");
  EXPECT_EQ(error([&] { open(text, {"a.=1"}); }), "--set a.=1: must be KEY.PATH=VALUE");
  EXPECT_EQ(error([&] { open(text, {"=1"}); }), "--set =1: must be KEY.PATH=VALUE");
  EXPECT_EQ(error([&] { open(text, {"list[x]=1"}); }), "--set list[x]=1: must be KEY.PATH=VALUE");
  EXPECT_EQ(error([&] { open(text, {"list[2].x=1"}); }), "--set list[2].x: there is no entry 2 (the list has 2)");
  // Sections that the file leaves out are made; lists are not.
  EXPECT_EQ(open(text, {"c.d.e=7", "c.d.f=8"}).map().require("c").map().require("d").map().require("e").number(), 7);
  EXPECT_EQ(error([&] { open(text, {"c.d=7"}).map().require("c").number(); }).substr(0, 8), "--set c:");
  EXPECT_EQ(error([&] { open(text, {"nobody[0]=1"}); }), "--set nobody[0]: there is no key 'nobody'");
  EXPECT_EQ(error([&] { open("list: [{name: a}, {name: b}]\n", {"list.c.x=1"}); }),
            "--set list.c.x: there is no entry of the name 'c' (allowed: a, b, or a number as in [0])");
  EXPECT_EQ(error([&] { open(text, {"a.b.c=1"}); }), "--set a.b.c: 'c' is looked for in '1', not in a map");
}

TEST(NearestWord, FindsMisspellingsOnly) {
  const std::vector<std::string> words{"fov", "position", "resolution", "roughness"};
  EXPECT_EQ(nearest_word("fvo", words), "fov");
  EXPECT_EQ(nearest_word("postion", words), "position");
  EXPECT_EQ(nearest_word("roughnes", words), "roughness");
  EXPECT_EQ(nearest_word("colour", words), "");
  EXPECT_EQ(nearest_word("", words), "");
}

TEST_F(YamlReader, EmptyOverridesRemove) {
  const std::string text = "a: {b: 1, c: 2}\nlist: [1, {x: 2}, 3]\n";
  EXPECT_FALSE(open(text, {"a.b="}).map().require("a").map().find("b"));
  EXPECT_TRUE(open(text, {"a.b= "}).map().require("a").map().find("c"));
  EXPECT_FALSE(open(text, {"a="}).map().find("a"));
  EXPECT_EQ(open(text, {"list[1]="}).map().require("list").numbers(), (std::vector<double>{1, 3}));
  EXPECT_FALSE(open(text, {"list[1].x="}).map().require("list").list()[1].map().find("x"));
  EXPECT_EQ(error([&] { open(text, {"a.z="}); }), "--set a.z: there is no key 'z' to remove");
  EXPECT_EQ(error([&] { open(text, {"list[3]="}); }), "--set list[3]: there is no entry 3 (the list has 3)");
}

}  // namespace
}  // namespace isochron
