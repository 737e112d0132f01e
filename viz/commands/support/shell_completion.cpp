// palpate completion: what completes its command line in bash, zsh and fish. The shells ask the program
// itself, by `palpate complete WORD...`, so that what they offer is what this version has.
#include <algorithm>
#include <filesystem>
#include <map>

#include "capture/synthetic/synthetic.h"
#include "capture/synthetic/tissue.h"
#include "engine/base/json.h"
#include "engine/gpu/context.h"
#include "palpate/error.h"
#include "viz/commands/command.h"
#include "viz/commands/support/options.h"

namespace palpate {
namespace {

namespace fs = std::filesystem;

constexpr const char* kBash = R"(# Completion of palpate in bash: source <(palpate completion bash)
_palpate() {
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
complete -F _palpate palpate
)";

constexpr const char* kZsh = R"(#compdef palpate
# Completion of palpate in zsh: source <(palpate completion zsh)
_palpate() {
  local word about kind
  local -a found
  while IFS=$'\t' read -r word about; do
    case $word in
      :files | :folders) kind=$word ;;
      *) found+=("${word//:/\\:}${about:+:$about}") ;;
    esac
  done < <("${words[1]}" complete "${(@)words[2,CURRENT]}" 2>/dev/null)
  (( $#found )) && _describe -V palpate found
  case $kind in
    :files) compset -P '*='; _files ;;
    :folders) compset -P '*='; _files -/ ;;
  esac
}
if [[ $funcstack[1] == _palpate ]]; then _palpate; else compdef _palpate palpate; fi
)";

constexpr const char* kFish = R"(# Completion of palpate in fish: palpate completion fish | source
function __palpate_complete
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
complete -c palpate -f -a '(__palpate_complete)'
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

Report script_of(const std::string& shell) {
  const char* script = shell == "bash" ? kBash : shell == "zsh" ? kZsh : kFish;
  return {script, json::Value({{"shell", shell}, {"script", script}}).dump(2), 0};
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

void add_completion(CommandLine& program, Common& common, Command& chosen) {
  CommandLine* command =
      program.add_subcommand("completion", "Print the shell's completion of commands, options and values");
  auto shell = std::make_shared<std::string>();
  command->add_option("SHELL", *shell, "bash, zsh or fish")
      ->required()
      ->check(Check::one_of({"bash", "zsh", "fish"}));
  add_common(*command, common,
             "  palpate completion bash > ~/.local/share/bash-completion/completions/palpate\n"
             "  palpate completion zsh > ~/.zfunc/_palpate        a folder of $fpath\n"
             "  palpate completion fish > ~/.config/fish/completions/palpate.fish\n"
             "In this shell alone: source <(palpate completion bash). Debian's package brings all three.\n");
  command->callback([&chosen, shell] { chosen = [shell] { return script_of(*shell); }; });
}

}  // namespace palpate
