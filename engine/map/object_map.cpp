#include "engine/map/object_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "engine/base/statistics.h"

namespace palpate {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr size_t kFewest_px = 200;   // of a key frame's contact
constexpr size_t kPrepared = 12;     // surfaces that are kept ready
constexpr uint32_t kOftenFused = 8;  // key frames after which the map is fused while more wait

}  // namespace

struct ObjectMap::Current {
  Waiting key;
  ContactSurface surface;
  RigidMotion motion;              // from the map to the pad, as far as is known
  std::vector<uint32_t> partners;  // the last key frame's first
  bool with_last = false;          // whether the first partner is that
  size_t next = 0;
  std::vector<GraphEdge> edges = {};  // their `to` is set once there is a node
  std::vector<double> residuals_mm = {};
  uint32_t alike = 0;  // partners that show nearly the same
  double best_overlap = 0;
  std::optional<size_t> best = {};  // whole edge of the largest overlap

  /// Where nothing is known of its place on another piece than its own.
  struct Search {
    uint32_t piece = 0;  // that is searched
    PlaceSearch places;
    std::vector<PlaceGuess> guesses = {};
    bool turning = true;  // guesses are still being made
    size_t next = 0;
    std::vector<GraphEdge> agreeing = {};
    std::vector<double> residuals_mm = {};
  };
  std::optional<Search> search = {};
  std::optional<GraphEdge> again = {};  // what the search has found
};

struct ObjectMap::Fusing {
  struct Member {
    uint32_t node;
    MapKey key;
  };
  std::vector<std::vector<Member>> pieces;
  std::vector<uint32_t> lowest;  // node of each
  size_t piece = 0, member = 0;
  std::optional<Fusion> fusion;
  struct Done {
    uint32_t lowest;
    MapPiece piece;
  };
  std::vector<Done> done;
  MapSnapshot told;
};

ObjectMap::ObjectMap(const MapOptions& options)
    : options_(options), snapshot_(std::make_shared<const MapSnapshot>()) {}
ObjectMap::~ObjectMap() = default;

void ObjectMap::add(const HeightMap& frame, const Pose& pose, uint64_t number) {
  now_track_ = 0;
  if (pose.state != PoseState::Begun && pose.state != PoseState::Tracked) return;
  now_track_ = pose.track;
  now_ = pose.motion;
  const RigidMotion since = pose.motion * last_key_motion_.inverse();
  const bool same = pose.track == last_track_;
  constexpr double kGrown = 1.5;
  const double area_mm2 =
      double(frame.contact.size() - static_cast<size_t>(std::ranges::count(frame.contact, 0))) *
      frame.pitch_mm_per_px * frame.pitch_mm_per_px;
  const bool grown = area_mm2 > kGrown * std::numbers::pi * last_key_.radius_mm() * last_key_.radius_mm();
  if (same && !grown && pose.keys == last_tracker_keys_ &&
      turn_vector(since.turn).norm() <= options_.key_turn_deg * kDegree &&
      last_key_.shown_by(frame, since) >= options_.key_overlap)
    return;
  {
    const std::lock_guard lock(mutex_);
    if (waiting_.size() >= options_.most_waiting) {
      ++missed_;
      return;
    }
  }
  last_key_ = KeyFrame(frame, options_.most_frame_px);
  last_key_motion_ = pose.motion;
  last_track_ = pose.track;
  last_tracker_keys_ = pose.keys;
  {
    const std::lock_guard lock(mutex_);
    waiting_.push_back({last_key_, pose.motion, pose.track, pose.residual_mm, number});
  }
  added_.notify_one();
}

std::optional<MapPlace> ObjectMap::place() const {
  const std::lock_guard lock(mutex_);
  if (now_track_ == 0 || !published_ || published_->track != now_track_) return std::nullopt;
  return MapPlace{published_->piece, now_ * published_->of_track.inverse() * published_->of_map};
}

std::shared_ptr<const MapSnapshot> ObjectMap::snapshot() const {
  const std::lock_guard lock(mutex_);
  return snapshot_;
}

bool ObjectMap::work(Work kind) {
  if (current_) {
    if (current_->search)
      search_one();
    else if (current_->next < current_->partners.size())
      link_one();
    else
      end_key();
    return true;
  }
  std::optional<Waiting> next;
  const bool places = kind == Work::Places;
  if (places || (!fusing_ && unfused_ < kOftenFused)) {
    const std::lock_guard lock(mutex_);
    if (!waiting_.empty()) {
      next = std::move(waiting_.front());
      waiting_.pop_front();
    }
  }
  if (next) {
    begin_key(std::move(*next));
    return true;
  }
  if (places || (!fusing_ && unfused_ == 0)) return false;
  if (fusing_)
    fuse_one();
  else
    begin_fusion();
  return true;
}

void ObjectMap::run(const std::stop_token& stop) {
  while (!stop.stop_requested()) {
    if (work()) continue;
    std::unique_lock lock(mutex_);
    added_.wait(lock, stop, [&] { return !waiting_.empty(); });
  }
}

const ContactSurface& ObjectMap::surface_of(uint32_t node) {
  const auto found = std::ranges::find(prepared_, node, &Prepared::node);
  if (found != prepared_.end()) return found->surface;
  const KeyFrame::Unpacked frame = keys_[node].frame.unpacked();
  prepared_.push_back({node, ContactSurface(frame.map(), options_.surface)});
  if (prepared_.size() > kPrepared) prepared_.pop_front();
  return prepared_.back().surface;
}

void ObjectMap::begin_key(Waiting waiting) {
  const KeyFrame::Unpacked frame = waiting.frame.unpacked();
  ContactSurface surface(frame.map(), options_.surface);
  if (surface.count() < kFewest_px) return;
  current_ = std::make_unique<Current>(
      Current{.key = std::move(waiting), .surface = std::move(surface), .motion = {}, .partners = {}});
  Current& now = *current_;
  if (anchor_ && anchor_->track == now.key.track) {
    const PoseGraph::Node& last = graph_.nodes()[anchor_->node];
    now.motion = now.key.motion * anchor_->of_track.inverse() * anchor_->from_node * last.motion;
    now.partners.push_back(anchor_->node);
    now.with_last = true;
    if (options_.loops) add_partners(last.piece);
  }
  if (options_.loops) begin_search();
}

/// Key frames of that piece which should show some of the same.
void ObjectMap::add_partners(uint32_t piece) {
  Current& now = *current_;
  const std::vector<PoseGraph::Node>& nodes = graph_.nodes();
  std::vector<std::pair<double, uint32_t>> others;
  for (uint32_t node = 0; node < nodes.size(); ++node) {
    if (nodes[node].piece != piece || std::ranges::count(now.partners, node) > 0) continue;
    const double overlap =
        keys_[node].frame.overlap(now.key.frame, now.motion * nodes[node].motion.inverse());
    if (overlap >= options_.link_overlap) others.emplace_back(overlap, node);
  }
  std::ranges::sort(others, std::greater<>());
  for (size_t k = 0; k < others.size() && now.partners.size() < options_.links; ++k)
    now.partners.push_back(others[k].second);
}

/// The largest piece is searched, unless it is the frame's own.
void ObjectMap::begin_search() {
  Current& now = *current_;
  if (searched_track_ != now.key.track) searches_ = 0;
  searched_track_ = now.key.track;
  const std::vector<PoseGraph::Node>& nodes = graph_.nodes();
  if (nodes.empty() || searches_ >= options_.searches) return;
  std::vector<uint32_t> sizes(nodes.size(), 0);
  for (const PoseGraph::Node& node : nodes) ++sizes[node.piece];
  const auto piece = static_cast<uint32_t>(std::ranges::max_element(sizes) - sizes.begin());
  if (now.with_last && nodes[anchor_->node].piece == piece) return;
  ++searches_;
  std::vector<PlaceSearch::Part> parts;
  for (uint32_t node = 0; node < nodes.size(); ++node)
    if (nodes[node].piece == piece) parts.push_back({keys_[node].frame, nodes[node].motion});
  now.search.emplace(Current::Search{.piece = piece, .places = {parts, now.key.frame}});
}

/// A turn of the search, or a guess that is tried by the key frame that shows most of it.
void ObjectMap::search_one() {
  Current& now = *current_;
  Current::Search& search = *now.search;
  if (search.turning) {
    search.turning = search.places.step();
    if (!search.turning) search.guesses = search.places.guesses();
    return;
  }
  if (search.next == search.guesses.size()) {
    end_search();
    return;
  }
  const RigidMotion& guess = search.guesses[search.next++].motion;
  const std::vector<PoseGraph::Node>& nodes = graph_.nodes();
  double most = options_.link_overlap;
  std::optional<uint32_t> partner;
  for (uint32_t node = 0; node < nodes.size(); ++node) {
    if (nodes[node].piece != search.piece) continue;
    const double overlap = keys_[node].frame.overlap(now.key.frame, guess * nodes[node].motion.inverse());
    if (overlap >= most) most = overlap, partner = node;
  }
  if (!partner) return;
  const Registration found = register_surface(
      surface_of(*partner), now.surface, guess * nodes[*partner].motion.inverse(), options_.registration);
  GraphEdge edge = edge_of(*partner, 0, found);
  constexpr double kMostDisagreement = 0.25;  // as a tracker's: more is another wave of a texture
  if (!agrees(found) || !edge.whole || found.overlap < options_.link_overlap ||
      found.disagreement > kMostDisagreement)
    return;
  edge.loop = true;
  search.agreeing.push_back(edge);
  search.residuals_mm.push_back(found.residual_mm);
}

/// One place is taken; of several that fit nearly as well none is known to be the right one, nor is one where
/// the map itself repeats.
void ObjectMap::end_search() {
  Current& now = *current_;
  Current::Search search = std::move(*now.search);
  now.search.reset();
  if (search.agreeing.empty()) return;
  const auto place = [&](size_t k) {
    return search.agreeing[k].motion * graph_.nodes()[search.agreeing[k].from].motion;
  };
  const auto best =
      static_cast<size_t>(std::ranges::min_element(search.residuals_mm) - search.residuals_mm.begin());
  constexpr double kClearly = 2;  // times the residual, at another place
  for (size_t k = 0; k < search.agreeing.size(); ++k) {
    const Vector6d apart = twist_between(place(best), place(k), now.key.frame.middle_mm());
    const bool same =
        apart.head<3>().norm() < 0.1 * now.key.frame.radius_mm() && apart.tail<3>().norm() < 5 * kDegree;
    if (same || search.residuals_mm[k] > kClearly * search.residuals_mm[best]) continue;
    ++ambiguous_;
    return;
  }
  if (search.places.map_repeats()) {
    ++repeating_;
    return;
  }
  now.again = search.agreeing[best];
  const RigidMotion there = place(best);
  if (now.with_last) return;  // the piece that its own track has made comes along
  now.motion = there;
  now.edges.push_back(*now.again);
  now.residuals_mm.push_back(search.residuals_mm[best]);
  now.best = 0;
  now.best_overlap = options_.link_overlap;
  now.partners.push_back(now.again->from);
  now.next = 1;
  add_partners(search.piece);
}

bool ObjectMap::agrees(const Registration& found) const {
  constexpr double kOverlap = 0.2, kFitting = 0.6, kResidual = 2.5;
  const double usual = median(residuals_mm_);
  return found.found && found.overlap >= kOverlap && found.fitting >= kFitting &&
         (usual <= 0 || found.residual_mm <= kResidual * usual);
}

void ObjectMap::link_one() {
  Current& now = *current_;
  const bool last = now.next == 0 && now.with_last;
  const uint32_t partner = now.partners[now.next++];
  const RigidMotion& there = graph_.nodes()[partner].motion;
  RegistrationOptions options = options_.registration;
  options.enough_residual_mm = 1.5 * std::max(now.key.residual_mm, median(residuals_mm_));
  const Registration found =
      register_surface(surface_of(partner), now.surface, now.motion * there.inverse(), options);
  if (!agrees(found)) return;
  GraphEdge edge = edge_of(partner, 0, found);
  edge.loop = !last;
  now.edges.push_back(edge);
  now.residuals_mm.push_back(found.residual_mm);
  if (!edge.whole) return;
  if (found.overlap > now.best_overlap) {
    now.best_overlap = found.overlap;
    now.best = now.edges.size() - 1;
    now.motion = found.motion * there;
  }
  constexpr double kAlike = 0.85, kAlikeTurn_deg = 15;
  if (found.overlap > kAlike && turn_vector(found.motion.turn).norm() < kAlikeTurn_deg * kDegree) ++now.alike;
}

void ObjectMap::end_key() {
  const std::unique_ptr<Current> now = std::move(current_);
  // A place that the other key frames there do not bear out is none.
  if (now->again && !now->with_last && 2 * now->edges.size() < now->partners.size()) {
    now->again.reset();
    now->best.reset();
    now->edges.clear();
    now->residuals_mm.clear();
    now->alike = 0;
  }
  if (now->again) ++found_again_;
  const bool full = keys_.size() >= options_.most_keys;
  if (now->alike >= options_.enough || full) {
    if (full) {
      const std::lock_guard lock(mutex_);
      ++missed_;
    } else {
      ++left_out_;
    }
    anchor_.reset();
    if (now->best) {
      const GraphEdge& edge = now->edges[*now->best];
      anchor_ = Anchor{now->key.track, now->key.motion, edge.from, edge.motion};
    }
    publish_anchor();
    return;
  }
  // One that hangs together with nothing has axes of its own.
  const uint32_t node = graph_.add(now->best ? now->motion : RigidMotion{}, now->key.frame.middle_mm());
  anchor_ = Anchor{now->key.track, now->key.motion, node, {}};
  keys_.push_back({std::move(now->key.frame), now->key.number});
  prepared_.push_back({node, std::move(now->surface)});
  if (prepared_.size() > kPrepared) prepared_.pop_front();
  residuals_mm_.insert(residuals_mm_.end(), now->residuals_mm.begin(), now->residuals_mm.end());
  for (GraphEdge edge : now->edges) {
    edge.to = node;
    if (edge.loop) ++loops_;
    graph_.connect(edge);
  }
  if (now->again && now->with_last) {
    GraphEdge edge = *now->again;
    edge.to = node;
    graph_.connect(edge);
    ++loops_;
  }
  graph_.solve();
  ++unfused_;
  publish_anchor();
}

void ObjectMap::publish_anchor() {
  const std::lock_guard lock(mutex_);
  published_.reset();
  if (!anchor_) return;
  const PoseGraph::Node& node = graph_.nodes()[anchor_->node];
  const auto at = std::ranges::find(piece_order_, node.piece);
  published_ = Published{anchor_->track, anchor_->of_track, anchor_->from_node * node.motion,
                         static_cast<uint32_t>(at - piece_order_.begin())};
}

void ObjectMap::begin_fusion() {
  graph_.solve(20);
  unfused_ = 0;
  fusing_ = std::make_unique<Fusing>();
  const std::vector<PoseGraph::Node>& nodes = graph_.nodes();
  const std::vector<Matrix6d> covariances = graph_.covariances();
  std::vector<std::vector<Fusing::Member>> of(nodes.size());
  for (uint32_t node = 0; node < nodes.size(); ++node)
    of[nodes[node].piece].push_back(
        {node, {keys_[node].number, nodes[node].motion, covariances[node], nodes[node].middle_mm}});
  MapSnapshot& told = fusing_->told;
  for (uint32_t piece = 0; piece < nodes.size(); ++piece) {
    // A frame by itself shows nothing that noise does not.
    if (of[piece].size() == 1 && nodes.size() > 1) ++told.smooth;
    if (of[piece].size() < 2 && nodes.size() > 1) continue;
    fusing_->pieces.push_back(std::move(of[piece]));
    fusing_->lowest.push_back(piece);
  }
  told.keys = static_cast<uint32_t>(nodes.size());
  told.loops = loops_;
  told.refused = static_cast<uint32_t>(graph_.refused());
  told.found_again = found_again_;
  told.ambiguous = ambiguous_;
  told.repeating = repeating_;
  told.left_out = left_out_;
  told.residual_mm = median(residuals_mm_);
  told.variance_factor = graph_.variance_factor();
}

void ObjectMap::fuse_one() {
  Fusing& job = *fusing_;
  if (job.piece == job.pieces.size()) {
    publish();
    return;
  }
  const std::vector<Fusing::Member>& members = job.pieces[job.piece];
  const auto part = [&](const Fusing::Member& m) {
    return Fusion::Part{keys_[m.node].frame, m.key.motion, m.key.covariance};
  };
  if (!job.fusion) {
    std::vector<Fusion::Part> parts;
    parts.reserve(members.size());
    for (const Fusing::Member& m : members) parts.push_back(part(m));
    const double own_mm = keys_[members.front().node].frame.pitch_mm();
    job.fusion.emplace(parts, Fusion::Options{.pitch_mm = options_.pitch_mm > 0 ? options_.pitch_mm : own_mm,
                                              .most_px = options_.most_map_px,
                                              .border_px = options_.surface.border_px});
    job.member = 0;
  }
  // All are added, then compared with what they are together.
  if (job.member < members.size())
    job.fusion->add(part(members[job.member]));
  else
    job.fusion->compare(part(members[job.member - members.size()]));
  if (++job.member < 2 * members.size()) return;
  MapPiece piece{job.fusion->finish(), {}};
  for (const Fusing::Member& m : members) {
    MapKey& key = piece.keys.emplace_back(m.key);
    key.covariance += piece.map.bend.of_motion(key.motion, key.middle_mm);
  }
  job.done.push_back({job.lowest[job.piece++], std::move(piece)});
  job.fusion.reset();
}

void ObjectMap::publish() {
  const std::unique_ptr<Fusing> job = std::move(fusing_);
  std::ranges::stable_sort(job->done, std::greater<>(),
                           [](const Fusing::Done& d) { return d.piece.map.covered_mm2(); });
  piece_order_.clear();
  for (Fusing::Done& done : job->done) {
    piece_order_.push_back(done.lowest);
    job->told.pieces.push_back(std::move(done.piece));
  }
  {
    const std::lock_guard lock(mutex_);
    job->told.missed = missed_;
    snapshot_ = std::make_shared<const MapSnapshot>(std::move(job->told));
  }
  publish_anchor();
}

}  // namespace palpate
