// A judgement as text, CSV and JSON.
#pragma once

#include <string>

#include "engine/base/json.h"
#include "perf/lab/judge/cells.h"

namespace palpate::judge {

/// Mean and worst cell of each quantity, and its tables; the same for verdicts. Lines of at most
/// 100 columns as long as there are at most four steps.
std::string judgement_text(const Judgement& judgement);
/// The lines alone that say mean and worst cell: one for each quantity, one for verdicts.
std::string judgement_summary(const Judgement& judgement);
/// One line a cell and quantity, and a line "verdict" a cell; empty cells of the table are not known. Rates
/// are shares, 0 to 1. The whole and what lacks a condition are lines with empty conditions.
std::string judgement_csv(const Judgement& judgement);
json::Value judgement_json(const Judgement& judgement);

/// One line a case: conditions (true_NAME where NAME is estimated too), NAME_truth, NAME, NAME_low, NAME_high
/// of each quantity, verdict ("reported", "refused") and, where there are any, wrong and group.
std::string cases_csv(const Cases& cases);

}  // namespace palpate::judge
