#include "viz/commands/support/shell_completion.h"

#include <algorithm>
#include <filesystem>
#include <map>

#include "capture/synthetic/object_options.h"
#include "capture/synthetic/synthetic.h"
#include "capture/synthetic/tissue.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

// In the scripts PROGRAM stands for the program's name.
constexpr const char* kBash = R"(# Completion of PROGRAM in bash: source <(PROGRAM completion bash)
_PROGRAM() {
  local word about mark part line=${COMP_LINE:0:COMP_POINT}
  local -a words more
  local -A kind=([:files]=file [:folders]=directory)
  read -ra words <<<"$line"
  [[ $line == *[[:space:]] ]] && words+=("")
  # Bash ends words at ':' and '=' too, and replaces only what is after the last of them.
  part=${words[-1]}
  for mark in : =; do
    [[ $COMP_WORDBREAKS == *$mark* ]] && part=${part##*$mark}
  done
  COMPREPLY=()
  while IFS=$'\t' read -r word about; do
    case $word in
      :files | :folders)
        compopt -o filenames 2>/dev/null
        mapfile -t more < <(compgen -A ${kind[$word]} -- "$part")
        COMPREPLY+=("${more[@]}")
        ;;
      *) COMPREPLY+=("${word#"${words[-1]%"$part"}"}") ;;
    esac
  done < <("$1" complete "${words[@]:1}" 2>/dev/null)
}
complete -F _PROGRAM PROGRAM
)";

constexpr const char* kZsh = R"(#compdef PROGRAM
# Completion of PROGRAM in zsh: source <(PROGRAM completion zsh)
_PROGRAM() {
  local word about kind
  local -a found
  while IFS=$'\t' read -r word about; do
    case $word in
      :files | :folders) kind=$word ;;
      *) found+=("${word//:/\\:}${about:+:$about}") ;;
    esac
  done < <("${words[1]}" complete "${(@)words[2,CURRENT]}" 2>/dev/null)
  (( $#found )) && _describe -V PROGRAM found
  case $kind in
    :files) compset -P '*='; _files ;;
    :folders) compset -P '*='; _files -/ ;;
  esac
}
if [[ $funcstack[1] == _PROGRAM ]]; then _PROGRAM; else compdef _PROGRAM PROGRAM; fi
)";

constexpr const char* kFish = R"(# Completion of PROGRAM in fish: PROGRAM completion fish | source
function __PROGRAM_complete
    set -l words (commandline -opc) (commandline -ct)
    for line in ($words[1] complete $words[2..-1] 2>/dev/null)
        switch $line
            case :files
                __fish_complete_path (string replace -r '^--[^=]*=' '' -- $words[-1])
            case :folders
                __fish_complete_directories (string replace -r '^--[^=]*=' '' -- $words[-1])
            case '*'
                echo $line
        end
    end
end
complete -c PROGRAM -f -a '(__PROGRAM_complete)'
)";

using Words = std::vector<Completions::Word>;

/// The first word of each usable device's name, or its index where another name begins alike.
Words devices() {
  std::vector<gpu::DeviceReport> all;
  try {
    all = gpu::list_devices();
  } catch (const Error&) {  // no driver: nothing to offer
  }
  const auto first = [](const gpu::DeviceReport& device) {
    return device.name.substr(0, device.name.find(' '));
  };
  Words words;
  for (const gpu::DeviceReport& device : all) {
    if (!device.refusals.empty()) continue;
    const auto same = std::ranges::count_if(all, [&](const gpu::DeviceReport& other) {
      return other.name.find(first(device)) != std::string::npos;
    });
    words.push_back({same == 1 ? first(device) : std::to_string(device.index), device.name});
  }
  return words;
}

Words cameras() {
  Words words;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator("/dev", error))
    if (entry.path().filename().string().starts_with("video")) words.push_back({entry.path().string(), ""});
  std::ranges::sort(words, {}, &Completions::Word::word);
  return words;
}

Words scenes() {
  Words words;
  for (const auto& [name, about] : synthetic_scenes()) words.push_back({name, about});
  words.push_back({"object", kObjectScene});
  words.push_back({"tissue", kTissueScene});
  return words;
}

Words inputs() {
  Words words;
  for (const auto& [name, about] : scenes()) words.push_back({"synthetic:" + name, about});
  for (const auto& [node, about] : cameras()) words.push_back({"camera:" + node, about});
  return words;
}

constexpr const char* kFiles = ":files";
constexpr const char* kFolders = ":folders";

/// Kind of a value, by the name that the help gives it.
struct Kind {
  const char* value;
  Words (*words)();
  const char* files;
};
constexpr Kind kKinds[] = {
    {"INDEX|NAME", devices, nullptr}, {"NODE", cameras, nullptr},    {"SCENE", scenes, nullptr},
    {"INPUT", inputs, kFiles},        {"RECORDING", inputs, kFiles}, {"DIR", nullptr, kFolders},
};
/// Arguments that are names of files, though their options hold them as texts.
constexpr const char* kFileValues[] = {"FILE", "MAPS", "DATA", "GRADIENTS", "RESULTS", "SETS", "IMAGE"};

/// With the program's name in it.
std::string named(std::string text, const std::string& name) {
  const std::string what = "PROGRAM";
  for (size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + name.size()))
    text.replace(at, what.size(), name);
  return text;
}

Report script_of(const std::string& shell, const std::string& name) {
  const char* pattern = shell == "bash" ? kBash : shell == "zsh" ? kZsh : kFish;
  const std::string script = named(pattern, name);
  return {script, json::Value({{"shell", shell}, {"script", script}}), 0};
}

}  // namespace

std::string completions(const CommandLine& program, const std::vector<std::string>& words) {
  const Completions found = program.complete(words);
  std::string text;
  const auto add = [&](const std::string& word, const std::string& about) {
    if (word.starts_with(words.back())) text += word + (about.empty() ? "" : "\t" + about) + "\n";
  };
  for (const auto& [word, about] : found.words) add(word, about);
  if (!found.words.empty() && found.value.empty()) return text;
  const auto kind = std::ranges::find(kKinds, found.value, &Kind::value);
  if (kind != std::end(kKinds)) {
    if (kind->words)
      for (const auto& [word, about] : kind->words()) add(found.prefix + word, about);
    if (kind->files) text += std::string(kind->files) + "\n";
  } else if (found.path || std::ranges::find(kFileValues, found.value) != std::end(kFileValues)) {
    text += std::string(kFiles) + "\n";
  }
  return text;
}

void add_completion(CommandLine& program, Common& common, Command& chosen, const std::string& name) {
  CommandLine* command =
      program.add_subcommand("completion", "Print the shell's completion of commands, options and values");
  auto shell = std::make_shared<std::string>();
  command->add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->check(Check::one_of({"bash", "zsh", "fish"}));
  add_common(
      *command, common,
      named("  PROGRAM completion bash > ~/.local/share/bash-completion/completions/PROGRAM\n"
            "  PROGRAM completion zsh > ~/.zfunc/_PROGRAM        a folder of $fpath\n"
            "  PROGRAM completion fish > ~/.config/fish/completions/PROGRAM.fish\n"
            "In this shell alone: source <(PROGRAM completion bash). Debian's package brings all three.\n",
            name));
  command->runs(chosen, [shell, name] { return script_of(*shell, name); });
}

}  // namespace palpate
