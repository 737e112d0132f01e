// Object map: one height map larger than the pad, from the frames of a pad that moves over an object.
#pragma once

#include <Eigen/Core>
#include <condition_variable>
#include <cstdint>
#include <deque>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <vector>

#include "engine/map/fusion.h"
#include "engine/map/key_frame.h"
#include "engine/map/place_search.h"
#include "engine/map/pose_graph.h"
#include "engine/motion/pose_tracker.h"

namespace palpate {

struct MapOptions {
  double pitch_mm = 0;               ///< of the map; 0: that of its key frames
  uint32_t most_frame_px = 100'000;  ///< key frames are halved until they have no more
  uint32_t most_keys = 400;          ///< of the whole map
  uint32_t most_map_px = 4u << 20;   ///< of a piece's map, whose pitch is doubled where it takes more
  uint32_t most_waiting = 64;        ///< key frames that wait for the work; more of them are left out
  // A frame becomes a key frame where it shares less than this with the last one, is turned by more, or has
  // half as much contact again.
  double key_overlap = 0.7;
  double key_turn_deg = 8;
  uint32_t links = 6;  ///< key frames at most that a new one is registered to
  double link_overlap = 0.3;
  bool loops = true;  ///< false: to the last one alone
  /// Key frames of a track that are searched for on the map, wherever it may be, until one is found; 0: none.
  uint32_t searches = 3;
  uint32_t enough = 4;  ///< a key frame is left out where that many show nearly the same
  SurfaceOptions surface = {};
  RegistrationOptions registration = {};
};

/// Where a frame lies, by what the map knows so far.
struct MapPlace {
  uint32_t piece = 0;  ///< index in MapSnapshot::pieces of the time, or more where it is not fused yet
  RigidMotion motion;  ///< from the map to the pad
};

struct MapKey {
  uint64_t frame = 0;   ///< as add() was told
  RigidMotion motion;   ///< from the map of its piece to the pad
  Matrix6d covariance;  ///< of the motion that is missing, seen at middle_mm, once the piece is aligned
  Eigen::Vector3d middle_mm = Eigen::Vector3d::Zero();  ///< of its contact, in the pad
};

/// Frames that hang together. The map's axes are the pad's at the piece's first key frame.
struct MapPiece {
  FusedMap map;
  std::vector<MapKey> keys;
};

struct MapSnapshot {
  std::vector<MapPiece>
      pieces;         ///< the largest first; smooth ones, whose places are not determined, are not among them
  uint32_t keys = 0;  ///< of all pieces and of none
  uint32_t smooth = 0;         ///< key frames that hang together with no other one
  uint32_t loops = 0;          ///< motions measured other than to the last key frame
  uint32_t refused = 0;        ///< of them, that did not agree with the rest
  uint32_t found_again = 0;    ///< tracks that began where the map was known
  uint32_t ambiguous = 0;      ///< searches that found several places alike, and took none
  uint32_t repeating = 0;      ///< searches that found one place of a map that repeats, and did not take it
  uint32_t left_out = 0;       ///< key frames that show what others show
  uint32_t missed = 0;         ///< key frames for which there was no room: waiting, or in the map
  double residual_mm = 0;      ///< median of what registrations left over
  double variance_factor = 1;  ///< as PoseGraph tells it
};

/// add() and place() come from one thread, work() from one thread, which may be another; snapshot() from any.
class ObjectMap {
 public:
  explicit ObjectMap(const MapOptions& options = {});
  ~ObjectMap();
  ObjectMap(const ObjectMap&) = delete;
  ObjectMap& operator=(const ObjectMap&) = delete;

  /// The next frame with its pose by a PoseTracker that sees all frames. Copies the frame where it becomes a
  /// key frame, and never waits for the work. Throws Error where the map is not as HeightMap says.
  void add(const HeightMap& frame, const Pose& pose, uint64_t number = 0);
  /// Where the last frame that was added lies; none before the first key frame of its track is worked in,
  /// without a track and where the last key frame is smooth.
  std::optional<MapPlace> place() const;

  enum class Work : uint8_t { All, Places };  ///< Places: no fusion
  /// One piece of work: a registration, a solution of the graph, or a key frame's fusion; false: there is
  /// none.
  bool work(Work kind = Work::All);
  /// All of it.
  void finish() {
    while (work()) {
    }
  }
  /// Works in this thread until it is told to stop.
  void run(const std::stop_token& stop);
  /// The newest map that is whole; never null.
  std::shared_ptr<const MapSnapshot> snapshot() const;

 private:
  struct Waiting {
    KeyFrame frame;
    RigidMotion motion;  ///< of the track
    uint32_t track = 0;
    double residual_mm = 0;  ///< as the tracker tells it
    uint64_t number = 0;
  };
  struct Kept {
    KeyFrame frame;
    uint64_t number = 0;
  };
  /// A key frame that is being registered to others.
  struct Current;
  struct Fusing;
  /// Where the last key frame that was worked in lies.
  struct Anchor {
    uint32_t track = 0;
    RigidMotion of_track;  ///< of the object since the track began
    uint32_t node = 0;
    RigidMotion from_node;
  };

  const ContactSurface& surface_of(uint32_t node);
  void begin_key(Waiting waiting);
  void begin_search();
  void search_one();
  void end_search();
  void add_partners(uint32_t piece);
  void link_one();
  void end_key();
  bool agrees(const Registration& found) const;
  void publish_anchor();
  void begin_fusion();
  void fuse_one();
  void publish();

  MapOptions options_;

  // Of the thread that adds.
  KeyFrame last_key_;
  RigidMotion last_key_motion_, now_;
  uint32_t last_track_ = 0, now_track_ = 0, last_tracker_keys_ = 0;

  // Of both.
  mutable std::mutex mutex_;
  std::condition_variable_any added_;
  std::deque<Waiting> waiting_;
  std::shared_ptr<const MapSnapshot> snapshot_;
  struct Published {
    uint32_t track = 0;
    RigidMotion of_track, of_map;
    uint32_t piece = 0;
  };
  std::optional<Published> published_;
  uint32_t missed_ = 0;

  // Of the thread that works.
  std::deque<Kept> keys_;  ///< of each node
  PoseGraph graph_;
  std::optional<Anchor> anchor_;
  std::unique_ptr<Current> current_;
  std::unique_ptr<Fusing> fusing_;
  std::vector<double> residuals_mm_;
  struct Prepared {
    uint32_t node;
    ContactSurface surface;
  };
  std::deque<Prepared> prepared_;
  uint32_t loops_ = 0, left_out_ = 0, found_again_ = 0, ambiguous_ = 0, repeating_ = 0;
  uint32_t searched_track_ = 0, searches_ = 0;  ///< of that track
  uint32_t unfused_ = 0;                        ///< key frames since the last fusion began
  std::vector<uint32_t> piece_order_;           ///< lowest nodes of the published pieces
};

}  // namespace palpate
